#!/usr/bin/env python3
"""`morphbus doctor`: in networks that are broken in known ways it names the fault, and what it says mends it."""
import ctypes
import json
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, Case, as_json, command, morphbus


def in_new_network(script):
    """Runs a shell script as root of a network of its own, in which nothing is set up."""
    return subprocess.run(['unshare', '-rn', 'bash', '-ec', script], capture_output=True, text=True, timeout=LIMIT)


def shell(*arguments):
    return ' '.join(f"'{word}'" for word in command(*arguments))


# From <sys/timex.h>: where `status` lies where long has 64 bits, its flag, and adjtimex's answer without a clock.
TIMEX_STATUS, STA_UNSYNC, TIME_ERROR = 40, 0x40, 5
LOOPBACK = 'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo'


class Doctor(Case):
    def findings(self, answer):
        return {finding['name']: finding for finding in answer['findings']}

    def test_a_network_without_a_route_is_mended_by_the_command_that_it_names(self):
        done = in_new_network(f'{shell("doctor", "--json")} || true')
        before = json.loads(done.stdout)
        self.assertFalse(before['ok'])
        route = self.findings(before)['route']
        self.assertEqual(route['health'], 'broken')
        self.assertNotIn('loop', self.findings(before))
        # As root of the network there is no sudo to ask.
        mend = route['mend'].replace('sudo ', '')
        after = json.loads(in_new_network(f'{mend}; {shell("doctor", "--json")}').stdout)
        self.assertTrue(after['ok'])
        self.assertEqual(self.findings(after)['route']['health'], 'ok')
        self.assertEqual(self.findings(after)['loop']['health'], 'ok')

    def test_an_interface_without_multicast_is_mended_by_the_command_that_it_names(self):
        broken = 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && ip link set lo multicast off'
        done = in_new_network(f'{broken}; {shell("doctor", "--json")} || true')
        interface = self.findings(json.loads(done.stdout))['interface']
        self.assertEqual(interface['health'], 'broken')
        mend = interface['mend'].replace('sudo ', '')
        after = json.loads(in_new_network(f'{broken}; {mend}; {shell("doctor", "--json")}').stdout)
        self.assertTrue(after['ok'])

    def test_a_firewall_or_a_loop_that_hears_nothing_is_broken(self):
        # Without the local table the kernel has a route out, but none in.
        done = in_new_network(f'{LOOPBACK}; sysctl -qw net.ipv4.conf.all.rp_filter=1 net.ipv4.conf.lo.rp_filter=1; '
                              f'ip addr del 127.0.0.1/8 dev lo; {shell("doctor", "--json")} || true')
        answer = json.loads(done.stdout)
        self.assertFalse(answer['ok'])

    def test_a_kernel_without_room_for_filters_is_named_with_the_command_that_mends_it(self):
        set_limit = 'echo {} >/proc/sys/net/core/optmem_max || exit 77'
        answers = {}
        for limit in 2000, 20480:
            done = in_new_network(f"{LOOPBACK}; {set_limit.format(limit)}; {shell('doctor', '--json')}")
            if done.returncode == 77:
                self.skipTest('net.core.optmem_max cannot be set here')
            answers[limit] = self.findings(json.loads(done.stdout))['filter']
            self.assertEqual(answers[limit]['figures']['limit_bytes'], limit)
        self.assertEqual(answers[2000]['health'], 'warning')
        self.assertIn('net.core.optmem_max=131072', answers[2000]['mend'])
        # What kernels before 6.8 give is enough.
        self.assertEqual(answers[20480]['health'], 'ok')

    def test_the_burst_is_measured_and_not_guessed(self):
        small = 'udpm://239.255.76.67:7667?ttl=0&recv_buf_size=20000'
        figures = {}
        for url in (small, 'udpm://239.255.76.67:7667?ttl=0'):
            answer = json.loads(in_new_network(f"{LOOPBACK}; {shell('doctor', '--json', '-l', url)}").stdout)
            finding = self.findings(answer)['buffer']
            figures[url] = finding['figures']
            enough = finding['figures']['kept'] >= finding['figures']['needed']
            self.assertEqual(finding['health'], 'ok' if enough else 'warning')
            if url == small:
                self.assertIn('recv_buf_size=4194304', finding['mend'])
        self.assertEqual(figures[small]['asked_bytes'], 20000)
        few, many = (f['kept'] for f in figures.values())
        self.assertLess(few, 100)
        self.assertGreater(many, few)
        self.assertLessEqual(many, figures[small]['burst'])

    def test_messages_for_other_machines_that_leave_by_the_loopback_are_warned_of(self):
        url = 'udpm://239.255.76.67:7667?ttl=1'
        answer = json.loads(in_new_network(f"{LOOPBACK}; {shell('doctor', '--json', '-l', url)}").stdout)
        interface = self.findings(answer)['interface']
        self.assertEqual(interface['health'], 'warning')
        self.assertIn('lo', interface['text'])

    def judged_before_and_after(self, name, broken, check='{doctor}'):
        """Breaks something in a network of its own, and lets that shell, as a person would, run what doctor says mends
        it; the finding of that name before and after."""
        doctor = check.format(doctor=shell('doctor', '--json'))
        first = json.loads(in_new_network(f'{LOOPBACK}; {broken}; {doctor} || true').stdout)
        before = self.findings(first)[name]
        # As root of the network there is no sudo to ask.
        mend = before['mend'].replace('sudo ', '')
        self.assertTrue(mend, before)
        done = in_new_network(f'{LOOPBACK}; {broken}; {mend} >&2; {doctor}')
        return before, self.findings(json.loads(done.stdout))[name]

    def test_few_files_and_processes_are_mended_by_the_command_that_is_named(self):
        # The soft limit is what stops people. Of processes there must be some for the shell itself.
        for name, broken, limit in (('files', 'ulimit -Sn 64', 64), ('processes', 'ulimit -Su 250', 250)):
            with self.subTest(name):
                before, after = self.judged_before_and_after(name, broken)
                self.assertEqual((before['health'], before['figures']['limit']), ('warning', limit))
                self.assertEqual((after['health'], after['figures']['limit']), ('ok', 4096))

    def test_above_the_hard_limit_only_root_can_mend_it(self):
        # Root of a network of one's own is not the machine's, so that this one is not run.
        done = in_new_network(f'{LOOPBACK}; ulimit -n 64; {shell("doctor", "--json")}')
        files = self.findings(json.loads(done.stdout))['files']
        self.assertEqual((files['health'], files['mend']), ('warning', 'sudo prlimit --pid $$ --nofile=4096'))

    def test_refused_namespaces_are_mended_by_the_command_that_is_named(self):
        for broken, check in (('echo 0 > /proc/sys/user/max_net_namespaces', '{doctor}'),
                              # Without root's rights it takes a user namespace, too.
                              ('echo 0 > /proc/sys/user/max_user_namespaces',
                               'setpriv --inh-caps=-all --bounding-set=-all {doctor}')):
            with self.subTest(broken):
                before, after = self.judged_before_and_after('namespaces', broken, check)
                self.assertEqual((before['health'], after['health']), ('warning', 'ok'))
                self.assertIn(broken.split('/')[-1] + '=', before['mend'])

    def test_a_url_that_asks_for_too_small_a_buffer_is_mended_by_the_command_that_is_named(self):
        # net.core.rmem_max cannot be written in a network of one's own: how a buffer that the kernel has cut is judged is
        # tested in machine_findings_test.cc.
        small = "export LCM_DEFAULT_URL='udpm://239.255.76.67:7667?ttl=0&recv_buf_size=20000'"
        before, after = self.judged_before_and_after('buffer', small)
        self.assertEqual((before['health'], before['figures']['asked_bytes']), ('warning', 20000))
        self.assertEqual(after['figures']['asked_bytes'], 4194304)
        self.assertGreater(after['figures']['kept'], before['figures']['kept'])
        if after['figures']['got_bytes'] == 4194304:
            self.assertEqual(after['health'], 'ok')

    def test_the_clock_is_judged_as_the_kernel_tells(self):
        # How the other state is judged, and timers that wake late, which nobody can order, are tested in
        # machine_findings_test.cc.
        state = ctypes.create_string_buffer(512)  # struct timex, of which nothing is set: it is only read.
        answer = ctypes.CDLL(None).adjtimex(state)
        status = ctypes.c_int.from_buffer(state, TIMEX_STATUS).value
        synchronized = answer not in (-1, TIME_ERROR) and not status & STA_UNSYNC
        findings = self.findings(json.loads(in_new_network(f'{LOOPBACK}; {shell("doctor", "--json")}').stdout))
        self.assertEqual((findings['clock']['health'], findings['clock']['mend']),
                         ('ok', '') if synchronized else ('warning', 'sudo timedatectl set-ntp true'))
        timer = findings['timer']
        self.assertLessEqual(timer['figures']['median_ms'], timer['figures']['worst_ms'])
        self.assertEqual((timer['health'], timer['mend']),
                         ('ok', '') if timer['figures']['median_ms'] < 5 else ('warning', 'sudo renice -n -10 -p $$'))

    def test_for_people_every_finding_has_a_line(self):
        done = in_new_network(f'{LOOPBACK}; {shell("doctor")}')
        for name in ('url', 'route', 'interface', 'loop', 'buffer', 'files', 'processes', 'namespaces', 'clock', 'timer'):
            self.assertRegex(done.stdout, rf'(?m)^(ok|warning) +{name} ')

    def test_a_run_in_its_own_network_is_looked_at_from_within(self):
        run = subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 600, '--isolate',
                                       '--realtime', '--run', 'patient', '--log', self.folder / 'x.log'),
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            from support import await_condition
            await_condition(lambda: as_json('runs')['runs'], 'the run is listed')
            answer = as_json('doctor', '--run', 'patient')
            self.assertIn('run patient', self.findings(answer)['url']['text'])
            self.assertIn(' lo;', self.findings(answer)['interface']['text'])
        finally:
            run.terminate()
            run.communicate(timeout=LIMIT)

    def test_a_url_that_cannot_be_used_is_refused(self):
        self.assertIn('nonsense', morphbus('doctor', '-l', 'nonsense://', status=2).stderr)
        morphbus('doctor', '--run', 'nobody', status=2)


if __name__ == '__main__':
    unittest.main()
