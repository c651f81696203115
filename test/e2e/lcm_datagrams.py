"""LCM's multicast group, joined without LCM: what tests listen and speak with that share no code with it or with us."""
import socket

GROUP, PORT = '239.255.76.67', 7667


def receiver(timeout):
    """A socket that gets every datagram of the group on the loopback; reading gives up after `timeout` seconds."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    # A run at full speed sends far more than the usual buffer holds before the test has its turn.
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
    listening.bind((GROUP, PORT))
    listening.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                         socket.inet_aton(GROUP) + socket.inet_aton('127.0.0.1'))
    listening.settimeout(timeout)
    return listening


def sender():
    """A socket whose datagrams to (GROUP, PORT) go out on the loopback."""
    speaking = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    speaking.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
    return speaking
