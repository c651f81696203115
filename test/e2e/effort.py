#!/usr/bin/env python3
"""Effort, from the motor to the program and into the comparison of gaits."""
import json
import unittest

from support import MODEL, PROGRAM, ROBOTS, SOURCE, Case, as_json, decode, morphbus, read_events

# Upper halves that say twice a second what their hips bear, and on which side.
FEELING = '''  behavior feel() {
    self.sleepds(5);
    if (self.jointEffort(hip) > 0) {
      print("lifts by", self.jointEffort(hip));
    } else {
      print("holds by", self.jointEffort(hip));
    }
  }
'''


class Effort(Case):
    def test_a_program_feels_efforts_under_its_conventions(self):
        text = PROGRAM.read_text()
        head = 'abstract role LegUpperHalf extends Module {\n'
        self.assertEqual(text.count(head), 1)
        program = self.folder / 'feeling.dyn'
        program.write_text(text.replace(head, head + FEELING))
        felt, signs = {}, {}
        for robot in ROBOTS:
            signs.clear()
            log = self.folder / f'{robot}.log'
            summary = as_json('run', MODEL, program, '--robot', robot, '--seconds', 4, '--inproc', '--log', log)
            efforts, hips = {}, {}
            for _, _, channel, data in read_events(log):
                if channel.endswith('/SIM/SENSORS'):
                    message = decode(data)
                    for module in message.modules:
                        efforts[module.name, message.header.tick] = module.joint_effort_si
                elif channel.endswith('/STATUS'):
                    message = decode(data)
                    hips |= {channel.split('/')[1]: (label.index, message.joint_sign[label.index])
                             for label in message.labels if label.name == 'hip'}
            for said in summary['prints']:
                joint, sign = hips[said['module']]
                tick = round(said['time'] * 50)
                effort = sign * efforts[said['module'], tick][joint]
                word, _, value = said['text'].split()
                self.assertEqual(word, 'lifts' if effort > 0 else 'holds', said)
                self.assertAlmostEqual(float(value), effort, delta=1e-5 * abs(effort))
                felt.setdefault(robot, {})[said['role'], tick] = said['text']
                signs[said['module']] = sign
        # Front and back modules lie the other way round, so that hips of both signs were read; both robots feel the same to the bit.
        self.assertEqual(set(signs.values()), {-1, 1})
        self.assertGreater(len(felt[ROBOTS[0]]), 20)
        self.assertEqual(felt[ROBOTS[0]], felt[ROBOTS[1]])
        self.assertEqual({text.split()[0] for text in felt[ROBOTS[0]].values()}, {'lifts', 'holds'})

    def snake(self, name, height):
        """The log of a snake whose wave is so high (degrees)."""
        log = self.folder / f'{name}.log'
        models = SOURCE / 'models'
        morphbus('run', models / 'snakes.m3l', models / 'programs' / 'snake.dyn', '--robot', 'mtran_snake4', '--set',
                 f'MtranUpDown.height_deg={height}', '--seconds', 8, '--inproc', '--log', log)
        return log

    def test_gaits_of_unequal_energy_are_told_apart(self):
        high, low = self.snake('high', 30.0), self.snake('low', 25.0)
        # Only what the gait costs is looked at.
        lenient = [f'--tolerance={name}=10' for name in ('cycle_s', 'forward_m', 'sideways_m', 'turn_rad', 'height_m', 'duty',
                                                         'range_rad', 'range_m', 'transport')]
        same = as_json('compare', high, high, '--level', 'gait')
        self.assertEqual(same['verdict'], 'equivalent')
        other = as_json('compare', high, low, '--level', 'gait', *lenient, status=1)
        over = [item['quantity'] for item in other['items'] if item['max'] > item['tolerance']]
        self.assertEqual(over, ['energy a cycle'])
        a, b = (other['figures'][which] for which in 'ab')
        share = 1 - b['gait']['energy_j'] / a['gait']['energy_j']
        self.assertGreater(share, 0.1)
        self.assertAlmostEqual(next(item['max'] for item in other['items'] if item['quantity'] == 'energy a cycle'), share, delta=1e-9)
        # The tolerance has a name.
        as_json('compare', high, low, '--level', 'gait', '--tolerance', f'energy={share + 0.01}', *lenient)
        # By their distance, too: cost times weight times distance is energy.
        for figures in (a, b):
            way = (figures['displacement'][0] ** 2 + figures['displacement'][2] ** 2) ** 0.5
            self.assertAlmostEqual(figures['cost_of_transport'] * 4 * 0.42 * 9.81 * way, figures['energy'],
                                   delta=1e-6 * figures['energy'])

    def test_without_physics_nothing_is_exerted_and_nothing_costs(self):
        log = self.folder / 'still.log'
        summary = as_json('run', MODEL, PROGRAM, '--robot', ROBOTS[0], '--seconds', 4, '--inproc', '--still', '--log', log)
        self.assertEqual([summary[key] for key in ('energy', 'cost_of_transport', 'no_cost', 'loads')], [None] * 4)
        efforts = {effort for _, _, channel, data in read_events(log) if channel.endswith('/SIM/SENSORS')
                   for module in decode(data).modules for effort in module.joint_effort_si}
        self.assertEqual(efforts, {0.0})

    def test_a_report_shows_what_motors_and_links_bore(self):
        log, page = self.folder / 'x.log', self.folder / 'x.html'
        morphbus('run', MODEL, PROGRAM, '--robot', ROBOTS[0], '--seconds', 4, '--inproc', '--log', log)
        morphbus('report', log, '-o', page)
        html = page.read_text()
        self.assertIn('<h2>Effort</h2>', html)
        figures = json.loads(html.split("id='figures'>")[1].split('</script>')[0])
        for joint, load in figures['loads']['joints'].items():
            self.assertIn(f"<tr><td>{joint}</td><td class='n'>{load['rms']:.3f}</td><td class='n'>{load['peak']:.3f}</td></tr>", html)
        up = sum(link['mean_n'][1] for link in figures['loads']['links'].values())
        self.assertAlmostEqual(up, 9 * 0.42 * 9.81, delta=0.02 * 9 * 0.42 * 9.81)


if __name__ == '__main__':
    unittest.main()
