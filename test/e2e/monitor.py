#!/usr/bin/env python3
"""The monitor over real sockets: an independent client, what is shown of logs and runs, control, and slow clients."""
import json
import os
import shutil
import socket
import struct
import subprocess
import unittest

from control_live import Live, written_so_far
from monitor_client import Monitor, WebSocket, run_client
from support import BIN, LIMIT, MODEL, PROGRAM, SCRATCH, ShortRun, as_json, await_condition, decode, morphbus, read_events


class Walk(ShortRun):
    """The log that the monitor shows: a run of the name under which its topics stand."""
    RUN = 'walk'


class IndependentClient(Walk):
    def test_foxglove_s_client_decodes_a_log_whole_under_both_names(self):
        monitor = Monitor(self, self.short)
        world, sensed, ticks, propagated = {}, {}, set(), 0
        for _, _, channel, data in read_events(self.short):
            if channel.endswith('/INFO') or not channel.startswith('walk/'):
                continue
            message = decode(data)
            if channel == 'walk/SIM/WORLD':
                for body in message.bodies:
                    world[message.header.sim_time_us, body.module_id, body.link] = body
            elif channel == 'walk/SIM/SENSORS':
                for module in message.modules:
                    sensed[message.header.sim_time_us, module.name] = module.joint_position_si
            elif channel == 'walk/SIM/CLOCK':
                ticks.add(message.header.tick)
            elif channel.endswith('/TRANSFORM') and message.has_pose:
                propagated += len(message.link_poses)
        for name in ('foxglove.websocket.v1', 'foxglove.sdk.v1'):
            with self.subTest(name):
                got = run_client(f'ws://127.0.0.1:{monitor.port}/', name, '--play', 'walk')
                self.assertEqual(got['protocol'], name)
                self.assertEqual(got['serverInfo']['metadata']['control'], 'no')
                tf = {(t, child): rest for kind, t, _, child, *rest in got['transforms'] if kind == 'tf'}
                compared, worst = 0, 0.0
                described = self.links()
                for (time_us, module, link), body in world.items():
                    values = tf[time_us, described[module][link]]
                    expected = [*body.position_m, *body.orientation_wxyz]
                    worst = max(worst, *(abs(a - b) for a, b in zip(values, expected)))
                    compared += 1
                self.assertEqual(compared, len(world))
                self.assertLess(worst, 1e-9)
                self.assertEqual(sum(1 for kind, _, _, child, *_ in got['transforms']
                                     if kind == 'tf_propagated' and '/propagated/' in child), propagated)
                joints = {}
                for time_us, module, _, position in got['joints']:
                    joints.setdefault((time_us, module), []).append(position)
                self.assertEqual(joints, {key: list(value) for key, value in sensed.items()})
                self.assertEqual(got['counts']['/walk/clock'], len(ticks))
                self.assertEqual(got['counts']['/walk/commands'], len(ticks) - 1)  # END has none
                for topic in ('description', 'scene', 'modules', 'connections', 'channels'):
                    self.assertGreaterEqual(got['counts'][f'/walk/{topic}'], 1, topic)

    def links(self):
        """Frame names by module id and link, as the model has them."""
        fk = as_json('fk', MODEL, '--robot', 'quadruped')
        modules = {}
        for name in fk['links']:
            module, link = name.split('.')
            modules.setdefault(module, []).append(f'walk/{module}/{link}')
        numbered = sorted(modules, key=lambda m: int(m[1:]))
        return [modules[m] for m in numbered]


class Playback(Walk):
    def test_seeks_steps_and_plays_each_client_by_itself(self):
        monitor = Monitor(self, self.short)
        first, second = WebSocket(monitor).greet(), WebSocket(monitor, query='').greet()
        self.assertEqual(first.info['metadata']['control'], 'yes')
        source, = json.loads(first.info['metadata']['sources'])
        self.assertEqual((source['name'], source['kind'], source['robot']), ('walk', 'log', 'quadruped'))
        first.call('/walk/pause', {})
        state = first.call('/walk/playback', {'from_us': 1_000_000, 'playing': False})
        self.assertEqual((state['time_us'], state['playing']), (1_000_000, False))
        first.subscribe('/walk/clock')
        frame = first.until(lambda m: isinstance(m, bytes) and m[0] == 1)
        self.assertEqual(struct.unpack_from('<Q', frame, 5)[0], 1_000_000_000)
        first.call('/walk/step', {'ticks': 3})
        times = [struct.unpack_from('<Q', first.until(lambda m: isinstance(m, bytes) and m[0] == 1), 5)[0]
                 for _ in range(3)]
        self.assertEqual(times, [1_020_000_000, 1_040_000_000, 1_060_000_000])
        for ticks in (0, -2, 1.5, 'x'):
            self.assertIn('whole number', first.call('/walk/step', {'ticks': ticks}), ticks)
        # The other one is where it was, and goes its own way, without the token too.
        state = second.call('/walk/playback', {'from_us': 2_000_000, 'playing': False})
        self.assertEqual(state['time_us'], 2_000_000)
        self.assertEqual(first.call('/walk/pause', {})['time_us'], 1_060_000)
        self.assertIn('number', second.call('/walk/playback', {'speed': -1}))
        self.assertIn('microseconds', second.call('/walk/playback', {'from_us': 'now'}))
        second.send({'op': 'setParameters', 'parameters': [{'name': '/walk/time', 'value': 0.5}], 'id': 'x'})
        answer = second.until(lambda m: isinstance(m, dict) and m.get('id') == 'x')
        self.assertEqual(answer['parameters'][0]['value'], 0.5)

    def test_foxglove_s_controls_play_pause_and_seek_each_client_by_itself(self):
        monitor = Monitor(self, self.short)
        client = WebSocket(monitor, query='', protocols='foxglove.sdk.v1').greet()
        self.assertIn('playbackControl', client.info['capabilities'])
        self.assertEqual(client.info['dataStartTime'], {'sec': 0, 'nsec': 0})
        end_us = json.loads(client.info['metadata']['sources'])[0]['end_us']
        self.assertEqual(client.info['dataEndTime'], {'sec': end_us // 1_000_000, 'nsec': end_us % 1_000_000 * 1000})
        # It begins at the log's start, playing.
        self.assertEqual(client.playback()['status'], 'playing')
        state = client.play(1, 2, 1_000_000_000, 'stop there')
        self.assertEqual(state, {'status': 'paused', 'time_ns': 1_000_000_000, 'speed': 2, 'did_seek': True, 'request': 'stop there'})
        # The messages of that time have come, and those of later ones come with the next request.
        client.subscribe('/walk/clock')
        frame = client.until(lambda m: isinstance(m, bytes) and m[0] == 1)
        self.assertEqual(struct.unpack_from('<Q', frame, 5)[0], 1_000_000_000)
        state = client.play(0, 100)
        self.assertEqual((state['status'], state['did_seek'], state['speed']), ('playing', False, 100))
        times = []
        while not times or times[-1] < end_us * 1000:
            times.append(struct.unpack_from('<Q', client.until(lambda m: isinstance(m, bytes) and m[0] == 1), 5)[0])
        self.assertEqual(times, [n * 20_000_000 for n in range(51, end_us // 20_000 + 1)])
        state = client.playback()
        self.assertEqual((state['status'], state['time_ns'], state['request']), ('ended', end_us * 1000, ''))
        # Who speaks the older protocol is told once it has asked, and is where it was.
        older = WebSocket(monitor).greet()
        self.assertEqual(older.play(1, 1, 500_000_000)['time_ns'], 500_000_000)
        self.assertEqual(older.call('/walk/speed', {'speed': 3})['speed'], 3)
        self.assertIn('command', self.refused_playback(client))

    def refused_playback(self, client):
        """What is said to a client that asks for a playback which there is not."""
        client.send(struct.pack('<BBfBQI', 3, 7, 1, 0, 0, 0), 2)
        return client.op('status')['message']

    def test_two_logs_stand_side_by_side(self):
        monitor = Monitor(self, self.short, self.short)
        client = WebSocket(monitor).greet()
        names = [s['name'] for s in json.loads(client.info['metadata']['sources'])]
        self.assertEqual(names, ['walk', 'walk-2'])
        self.assertIn('/walk/tf', client.channels)
        self.assertIn('/walk-2/tf', client.channels)
        # Who answers to whom in them: of one and the same log every module to itself, by its role.
        client.subscribe('/pairs')
        frame = client.until(lambda m: isinstance(m, bytes) and m[0] == 1)
        for role in ('Junction', 'FrontLeftUpperHalf', 'BackRightLowerHalf'):
            self.assertIn(role.encode(), frame)
        alone = WebSocket(Monitor(self, self.short)).greet()
        self.assertNotIn('/pairs', alone.channels)
        for name in names:
            self.assertEqual(client.call(f'/{name}/playback', {'playing': False, 'from_us': 0})['time_us'], 0)

    def test_why_a_module_has_a_role_or_none(self):
        log = self.folder / 'lost.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'walk', '--seconds', '4', '--inproc', '--lose', 'm2@2',
                 '--log', log, status=None)
        client = WebSocket(Monitor(self, log)).greet()
        # While all have their roles nothing is missing. What roles ask for is what `roles --why` says of the robot at rest.
        self.assertEqual(client.call('/walk/missing_roles', {'time_us': 1_900_000})['modules'], {})
        role = as_json('roles', MODEL, PROGRAM, '--robot', 'quadruped')['modules']['m4']['role']
        told = client.call('/walk/explain_role', {'module': 'm4', 'role': role, 'time_us': 0})
        why = as_json('roles', MODEL, PROGRAM, '--robot', 'quadruped', '--why', 'm4', role)
        self.assertTrue(told['fits'])
        self.assertEqual([(part['line'], part['holds'], part['finding']) for part in told['parts']],
                         [(part['line'], part['holds'], part['finding']) for part in why['parts']])
        # Without m2, which is lost and of which nobody is told anything, the others have none.
        missing = client.call('/walk/missing_roles', {'time_us': 3_900_000})
        self.assertEqual(sorted(missing['modules']), sorted(f'm{i}' for i in range(1, 10) if i != 2))
        junction = [line for line in missing['modules']['m3'] if line['text'].startswith('not Junction: ')]
        self.assertEqual(junction, [{'line': 15, 'text': 'not Junction: this requirement fails, measured 2 against 4', 'file': str(PROGRAM)}])
        self.assertIn('m9', client.call('/walk/explain_role', {'module': 'm99', 'role': role, 'time_us': 0}))
        self.assertIn('time_us', client.call('/walk/missing_roles', {}))

    def test_a_log_that_was_cut_tells_where(self):
        cut = self.folder / 'cut.log'
        with open(self.short, 'rb') as whole:
            data = whole.read()
        cut.write_bytes(data[:len(data) // 2])
        damage = Monitor(self, cut).said['sources'][0]['damage']
        self.assertTrue(damage['cut'])
        end = Monitor(self, self.short).said['sources'][0]
        self.assertIsNone(end['damage'])
        self.assertTrue(0 < damage['time_us'] < end['end_us'])

    def test_what_is_no_log_is_refused_in_a_sentence(self):
        done = morphbus('monitor', PROGRAM, '--port', '0', status=2)
        self.assertIn('does not hold', done.stderr)
        self.assertIn('No such file', morphbus('monitor', 'nowhere.log', '--port', '0', status=2).stderr)
        self.assertIn('no address', morphbus('monitor', self.short, '--bind', 'nowhere', status=2).stderr)
        self.assertIn('--token', morphbus('monitor', self.short, '--token', 'a b', status=2).stderr)
        with socket.create_server(('127.0.0.1', 0)) as taken:
            done = morphbus('monitor', self.short, '--port', taken.getsockname()[1], status=2)
        self.assertIn('--port', done.stderr)


    def test_a_missing_log_is_complained_of_before_a_missing_page(self):
        # The page is looked for beside the program, so that one in a folder of its own has none.
        program = SCRATCH / f'pageless-{os.getpid()}' / 'bin' / 'morphbus'
        program.parent.mkdir(parents=True)
        self.addCleanup(shutil.rmtree, program.parent.parent)
        os.link(BIN / 'morphbus', program)

        def said(log, status):
            done = subprocess.run([program, 'monitor', log, '--port', '0', '--seconds', '0.01'], capture_output=True,
                                  text=True, timeout=LIMIT)
            self.assertEqual(done.returncode, status, done.stderr)
            return done.stderr
        self.assertIn("without the monitor's page", said(self.short, 0))
        missing = said('nope.log', 2)
        self.assertIn('No such file', missing)
        self.assertNotIn('page', missing)


class Waiting(Live):
    def test_the_page_waits_for_a_run_if_none_is_there(self):
        monitor = Monitor(self)
        self.assertEqual(monitor.said['sources'], [])
        client = WebSocket(monitor)
        self.assertEqual(json.loads(client.op('serverInfo')['metadata']['sources']), [])
        self.start()
        # The server that waited goes, and another one is at the same place.
        with self.assertRaises((EOFError, ConnectionError)):
            client.until(lambda m: False)

        def sources():
            try:
                again = WebSocket(monitor).greet()
            except (OSError, AssertionError, EOFError):
                return []
            again.close()
            return [s['name'] for s in json.loads(again.info['metadata']['sources']) if s['kind'] == 'live']
        self.assertEqual(await_condition(sources, 'the run is shown'), ['live'])
        self.control('stop')
        self.end()


class OfARun(Live):
    def setUp(self):
        super().setUp()
        self.start()
        self.monitor = Monitor(self, '--run', 'live')

    def test_the_independent_client_hears_every_topic(self):
        got = run_client(f'ws://127.0.0.1:{self.monitor.port}/', 'foxglove.sdk.v1', '--live')
        self.assertEqual({topic for topic, count in got['counts'].items() if count == 0 and topic.startswith('/live/')} -
                         {'/live/faults', '/live/prints', '/live/traces', '/live/log', '/live/health', '/live/channels'}, set())

    def test_what_was_before_the_monitor_came_is_at_hand(self):
        # The logger writes a block at a time.
        log = f'{self.path}.partial'
        await_condition(lambda: any(channel.endswith('/CLOCK') for _, _, channel, _ in written_so_far(log)), 'the log has begun')
        client = WebSocket(Monitor(self, '--run', 'live')).greet()
        past, live = json.loads(client.info['metadata']['sources'])
        self.assertEqual((past['kind'], past['past_of'], live['name'], live['kind']), ('log', 'live', 'live', 'live'))
        state = client.call(f'/{past["name"]}/playback', {'from_us': 0, 'playing': False})
        self.assertEqual((state['begin_us'], state['time_us']), (0, 0))
        self.assertGreater(past['end_us'], 0)

    def test_pauses_steps_pushes_and_changes_speed_for_who_has_the_token(self):
        client = WebSocket(self.monitor).greet()
        paused = client.call('/live/pause', {})
        self.assertEqual(paused['command'], 'pause')
        stepped = client.call('/live/step', {'ticks': 5})
        self.assertEqual(stepped['command'], 'step 5')
        client.subscribe('/live/clock')
        client.send({'op': 'subscribeParameterUpdates', 'parameterNames': ['/live/paused']})
        self.assertEqual(client.call('/live/resume', {})['command'], 'resume')
        client.until(lambda m: isinstance(m, dict) and m['op'] == 'parameterValues' and
                     m['parameters'][0]['value'] is False)
        pushed = client.call('/live/push', {'body': 'm5', 'direction': 'EAST', 'newtons': 2, 'seconds': 0.5})
        self.assertEqual(pushed['command'], 'push m5 EAST 2 0.5')
        self.assertEqual(client.call('/live/control', {'command': 'speed 2'})['command'], 'speed 2')
        self.assertIn('did you mean', client.call('/live/control', {'command': 'puse'}))
        client.send({'op': 'setParameters', 'parameters': [{'name': '/live/paused', 'value': True}], 'id': 'p'})
        client.until(lambda m: isinstance(m, dict) and m.get('id') == 'p')
        await_condition(lambda: self.control('step')['tick'], 'the run takes a step')

    def test_who_comes_while_the_run_is_paused_sees_it_all_the_same(self):
        held = self.control('pause')['tick']
        self.await_held(held)
        late = Monitor(self, '--run', 'live')
        client = WebSocket(late).greet()
        topics = [f'/live/{name}' for name in ('tf', 'joints', 'tf_propagated', 'commands', 'modules')]
        client.subscribe(*topics)
        names = {number: topic for topic, number in client.channels.items()}
        missing = set(topics)
        while missing:
            frame = client.until(lambda m: isinstance(m, bytes) and m[0] == 1)
            number, time_ns = struct.unpack_from('<IQ', frame, 1)
            self.assertLessEqual(time_ns, held * 20_000_000)
            missing.discard(names[number])
        self.await_held(held)
        self.control('stop')
        self.assertEqual(self.end()['lost'], 0)

    def test_deploys_what_compiles_and_tells_what_does_not(self):
        client = WebSocket(self.monitor).greet()
        refusal = client.call('/live/deploy', {'name': 'bad.dyn', 'text': 'role X extends Nothing {}'})
        self.assertIn('bad.dyn:1', refusal)
        text = PROGRAM.read_text()
        answer = client.call('/live/deploy', {'name': 'same.dyn', 'text': text})
        self.assertTrue(answer['command'].startswith('deploy same.dyn'), answer)
        self.assertIn('switch_seconds', answer)

    def test_without_the_token_one_can_look_and_nothing_else(self):
        guest = WebSocket(self.monitor, query='').greet()
        self.assertEqual(guest.info['metadata']['control'], 'no')
        for service, request in (('pause', {}), ('control', {'command': 'stop'}),
                                 ('deploy', {'name': 'a.dyn', 'text': 'role A extends Module {}'})):
            self.assertIn('token', guest.call(f'/live/{service}', request))
        guest.send({'op': 'setParameters', 'parameters': [{'name': '/live/paused', 'value': True}], 'id': 'p'})
        self.assertIn('token', guest.op('status')['message'])
        guest.subscribe('/live/clock')
        guest.until(lambda m: isinstance(m, bytes) and m[0] == 1)
        self.assertIsNone(self.process.poll())

    def test_a_client_that_stops_reading_holds_up_neither_run_nor_others(self):
        stuck = WebSocket(self.monitor, query='', receive_buffer=4096).greet()
        stuck.subscribe(*(t for t in stuck.channels))
        other = WebSocket(self.monitor).greet()
        other.subscribe('/live/clock')
        begin = self.control('speed', 0)['tick']
        # Far more than any buffer of the kernel holds goes to the other one meanwhile.
        self.reach(begin + 600)
        tick = None
        while tick is None or tick < (begin + 400) * 20_000_000:
            tick = struct.unpack_from('<Q', other.until(lambda m: isinstance(m, bytes) and m[0] == 1), 5)[0]
        # When it reads again it is told what it missed. At the wall's pace a reader of any speed comes to the end of what waits.
        self.control('speed', 1)
        status = stuck.op('status')
        self.assertEqual((status['level'], status['id']), (1, 'missed'))
        self.assertRegex(status['message'], r'^missed \d+ messages: .*/live/tf \d+')


if __name__ == '__main__':
    unittest.main()
