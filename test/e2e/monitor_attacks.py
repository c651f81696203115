#!/usr/bin/env python3
"""Every attack on the monitor that its documentation says is refused (docs/monitor-protocol.md, Safety), over real
sockets."""
import select
import socket
import struct
import unittest

from monitor_client import TOKEN, Monitor, WebSocket
from support import ShortRun, await_condition


class Attacks(ShortRun):
    """Each is refused and counted, and whoever plays by the rules notices nothing."""
    RUN = 'walk'

    def watch(self, monitor):
        """A client that plays by the rules; it must still be served when all is over."""
        client = WebSocket(monitor).greet()
        client.subscribe('/walk/clock')
        return client

    def still_served(self, client):
        self.assertTrue(client.call('/walk/playback', {'playing': True, 'from_us': 0, 'speed': 0})['playing'])
        client.until(lambda m: isinstance(m, bytes) and m[0] == 1)

    def test_rebinding_and_cross_site_requests(self):
        monitor = Monitor(self, self.short)
        client = self.watch(monitor)
        self.assertIn(' 200 ', monitor.get('/').splitlines()[0])
        self.assertIn(' 403 ', monitor.get('/', host='evil.example').splitlines()[0])
        # What follows the name is a port, and nothing else.
        for host in (f'localhost:{monitor.port}.evil.com', 'localhost:evil', '[::1]evil', '[::1'):
            self.assertIn(' 403 ', monitor.get('/', host=host).splitlines()[0], host)
        self.assertIn(' 400 ', monitor.request('GET / HTTP/1.1\r\n\r\n').splitlines()[0])
        self.assertIn(' 400 ', monitor.get('/', headers='Host: evil.example\r\n').splitlines()[0])
        WebSocket(monitor, headers='Origin: http://evil.example\r\n', expect=403)
        WebSocket(monitor, headers='Origin: null\r\n', expect=403)
        WebSocket(monitor, headers=f'Origin: http://127.0.0.1:{monitor.port}\r\n').close()
        self.still_served(client)
        self.assertEqual(monitor.stop(), {'host': 5, 'origin': 2, 'malformed': 2})

    def test_an_origin_that_was_allowed_connects(self):
        monitor = Monitor(self, self.short, '--allow-origin', 'https://viewer.example')
        WebSocket(monitor, headers='Origin: https://viewer.example\r\n').greet()
        WebSocket(monitor, headers='Origin: https://other.example\r\n', expect=403)

    def test_paths_that_lead_elsewhere(self):
        monitor = Monitor(self, self.short)
        targets = ['/../../../etc/passwd', '/%2e%2e/%2e%2e/etc/passwd', '//etc/passwd', '/..\\..\\etc\\passwd',
                   '/etc/passwd%00.html', '/.', '/proc/self/environ']
        for target in targets:
            answer = monitor.get(target)
            self.assertIn(' 404 ', answer.splitlines()[0], target)
            self.assertNotIn('root:', answer)
        self.assertIn(' 405 ', monitor.get('/', method='POST').splitlines()[0])
        self.assertEqual(monitor.stop(), {'path': len(targets), 'method': 1})

    def test_a_wrong_token_and_guests_who_want_to_control(self):
        monitor = Monitor(self, self.short)
        WebSocket(monitor, query='?token=wrong-token-0000', expect=403)
        WebSocket(monitor, protocols='chat', expect=400)
        WebSocket(monitor, protocols='', expect=400)
        self.assertEqual(monitor.stop(), {'token': 1, 'protocol': 2})

    def test_behind_bind_nothing_is_shown_without_the_token(self):
        monitor = Monitor(self, self.short, '--bind', '0.0.0.0')
        self.assertIn(' 403 ', monitor.get('/').splitlines()[0])
        self.assertIn(' 200 ', monitor.get(f'/?token={TOKEN}').splitlines()[0])
        WebSocket(monitor, query='', expect=403)
        WebSocket(monitor).greet()
        self.assertEqual(monitor.stop(), {'token': 2})

    def test_oversized_and_broken_messages(self):
        monitor = Monitor(self, self.short)
        client = self.watch(monitor)
        self.assertIn(' 431 ', monitor.get('/', headers='X: ' + 'x' * 20000 + '\r\n').splitlines()[0])
        self.assertIn(' 400 ', monitor.request('\x16\x03\x01\x02\x00garbage\r\n\r\n').splitlines()[0])
        big = WebSocket(monitor)

        def ended():
            # The server may hang up before it has read all of it.
            big.send('x' * (2 << 20))
            big.until(lambda m: False)
        self.assertRaises((EOFError, OSError), ended)
        # A frame that claims a size that nobody can have.
        claim = WebSocket(monitor)
        claim.socket.sendall(bytes([0x82, 0xFF]) + struct.pack('>Q', 1 << 62) + b'\0\0\0\0')
        self.assertRaises((EOFError, OSError), lambda: claim.until(lambda m: False))
        # A frame that no client may send: without a mask, of a reserved kind.
        for frame in (bytes([0x81, 2]) + b'{}', bytes([0x83, 0x80, 0, 0, 0, 0])):
            broken = WebSocket(monitor)
            broken.socket.sendall(frame)
            self.assertRaises((EOFError, OSError), lambda: broken.until(lambda m: False))
            broken.close()
        big.close()
        claim.close()
        self.still_served(client)
        expected = {'too_large': 3, 'malformed': 3}
        await_condition(lambda: monitor.refused() == expected, 'each is counted once')
        self.assertEqual(monitor.stop(), expected)

    def test_slow_loris(self):
        monitor = Monitor(self, self.short)
        client = self.watch(monitor)
        slow = [monitor.connect() for _ in range(20)]
        for s in slow:
            s.sendall(b'GET / HTTP/1.1\r\nHost: localhost\r\nX: ')
        # They dribble on, a byte now and then; each is closed all the same.
        open_ones = list(slow)

        def all_closed():
            for s in list(open_ones):
                try:
                    s.sendall(b'x')
                    readable, _, _ = select.select([s], [], [], 0)
                    if readable and not s.recv(1):
                        open_ones.remove(s)
                except OSError:
                    open_ones.remove(s)
            return not open_ones
        await_condition(all_closed, 'all slow connections are closed')
        self.still_served(client)
        self.assertEqual(monitor.stop(), {'timeout': 20})

    def test_thousands_of_connections(self):
        monitor = Monitor(self, self.short)
        client = self.watch(monitor)
        held = []
        for _ in range(3000):
            s = monitor.connect()
            if len(held) < 200:
                held.append(s)
            else:
                s.close()
        # Of those that are held open most are closed at once: there is no place for them.
        refused = 0

        def most_are_closed():
            nonlocal refused
            refused = 0
            for s in held:
                try:
                    readable, _, _ = select.select([s], [], [], 0)
                    refused += 1 if readable and s.recv(1, socket.MSG_PEEK) == b'' else 0
                except OSError:
                    refused += 1
            return refused > 100
        await_condition(most_are_closed, 'most connections are closed')
        for s in held:
            s.close()
        self.still_served(client)
        # On a machine so slow that some of them had to be given up first, that made place for others.
        counts = monitor.stop()
        self.assertGreaterEqual(counts.get('connections', 0) + counts.get('timeout', 0), refused)

    def test_guests_leave_room_for_who_has_the_token(self):
        monitor = Monitor(self, self.short)
        guests = [WebSocket(monitor, query='').greet() for _ in range(16)]
        WebSocket(monitor, query='', expect=503)
        self.still_served(self.watch(monitor))
        for guest in guests:
            guest.close()
        self.assertEqual(monitor.stop(), {'connections': 1})

    def test_a_client_that_asks_and_never_reads_is_given_up(self):
        monitor = Monitor(self, self.short)
        client = self.watch(monitor)
        greedy = WebSocket(monitor, receive_buffer=4096)

        def given_up():
            try:
                for _ in range(1000):
                    greedy.send({'op': 'getParameters'})
            except OSError:
                return True
            return False
        await_condition(given_up, 'the server answers no more', pause=0)
        self.still_served(client)
        self.assertGreaterEqual(monitor.stop()['overrun'], 1)


if __name__ == '__main__':
    unittest.main()
