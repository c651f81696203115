#!/usr/bin/env python3
"""`morphbus doctor`: in networks that are broken in known ways it names the fault, and what it says mends it."""
import json
import subprocess
import unittest

from support import MODEL, PROGRAM, Case, as_json, command, morphbus


def in_new_network(script):
    """Runs a shell script as root of a network of its own, in which nothing is set up."""
    return subprocess.run(['unshare', '-rn', 'bash', '-ec', script], capture_output=True, text=True, timeout=60)


def shell(*arguments):
    return ' '.join(f"'{word}'" for word in command(*arguments))


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

    def test_few_files_and_processes_are_warned_of(self):
        done = in_new_network(f'{LOOPBACK}; ulimit -n 64; {shell("doctor", "--json")}')
        files = self.findings(json.loads(done.stdout))['files']
        self.assertEqual((files['health'], files['figures']['limit']), ('warning', 64))
        self.assertIn('ulimit -n', files['mend'])

    def test_refused_namespaces_are_warned_of(self):
        done = in_new_network(f'{LOOPBACK}; echo 0 > /proc/sys/user/max_net_namespaces; {shell("doctor", "--json")}')
        self.assertEqual(self.findings(json.loads(done.stdout))['namespaces']['health'], 'warning')

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
            run.communicate(timeout=60)

    def test_a_url_that_cannot_be_used_is_refused(self):
        self.assertIn('nonsense', morphbus('doctor', '-l', 'nonsense://', status=2).stderr)
        morphbus('doctor', '--run', 'nobody', status=2)


if __name__ == '__main__':
    unittest.main()
