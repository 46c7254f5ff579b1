"""A server on the loopback that counts who connects, and names that would lead a careless program to it."""

import socket
from contextlib import contextmanager
from threading import Thread


class Canary:
    """Counts connections, and answers none."""

    def __init__(self, server):
        self.server, self.n_requests = server, 0
        self.port = server.getsockname()[1]

    def listen(self):
        while True:
            try:
                connection, _ = self.server.accept()
            except OSError:
                return
            self.n_requests += 1
            connection.close()


@contextmanager
def canary():
    with socket.create_server(("127.0.0.1", 0)) as server:
        watch = Canary(server)
        Thread(target=watch.listen, daemon=True).start()
        yield watch


SCHEMES = ["http", "https", "ftp", "tcp", "rtmp", "rtp", "udp", "gopher", "icecast", "mmsh", "srtp", "hls", "rtsp"]
WRAPPERS = [
    "async:",
    "cache:",
    "concat:",
    "crypto:",
    "data:",
    "fd:",
    "file:",
    "pipe:",
    "subfile:",
    "tee:",
    "ffrtmphttp:",
]


def hostile_names(port):
    """Names that take FFmpeg, or a program that opens whatever it is given, to an address, a pipe or another folder."""
    host = f"127.0.0.1:{port}"
    names = [f"{scheme}:{slashes}{host}/x.mp4" for scheme in SCHEMES for slashes in ("/", "//", "///")]
    names += [f"{wrapper}{scheme}://{host}/x.mp4" for wrapper in WRAPPERS for scheme in ("http", "tcp", "ftp", "file")]
    names += [
        f"subfile,,start,0,end,9,,:http://{host}/x.mp4",
        f"concat:a.mp4|http://{host}/x",
        "pipe:0",
        "pipe:",
        "fd:",
    ]
    names += [f"\\\\127.0.0.1@{port}\\x.mp4", f"//127.0.0.1:{port}/x.mp4", f"@http://{host}/x", f"-i http://{host}/x"]
    names += ["", " ", ".", "..", "/", "//", "~", "~root/x", "-", "--help", "CON", "NUL", "x\0y", "x\ny", "x\x1b[31my"]
    names += [
        "../" * 40 + "etc/passwd",
        "/etc/passwd",
        "/dev/zero",
        "/dev/full",
        "/dev/tty",
        "/dev/stdin",
        "/proc/self/mem",
    ]
    names += [
        "/proc/self/environ",
        "/dev/random",
        "/proc/kmsg",
        "/sys/kernel/notes",
        "trial.toml",
        "pipe.fifo",
        "a" * 300,
    ]
    names += [
        "a/" * 3000,
        "%s%n%x",
        "{0}",
        "${HOME}",
        "$(touch owned)",
        "`touch owned`",
        "; touch owned",
        "| touch owned",
    ]
    names += [
        "x.m3u8",
        "x.ffconcat",
        "x.sdp",
        "x.mpd",
        "x%03d.png",
        "x*.png",
        "x?.mp4",
        "[x].mp4",
        "ä\u202e.mp4",
        "\U0001f600",
    ]
    names += [
        f"{word}:x" for word in ("alsa", "lavfi", "v4l2", "x11grab", "kmsgrab", "fbdev", "dvd", "bluray", "smb", "sftp")
    ]
    names += [f"glob:{part}" for part in ("*", "../*", "/etc/*")] + [f"md5:{part}" for part in ("owned", "../owned")]
    names += [f"{scheme}://user:word@{host}/x?y#z" for scheme in SCHEMES] + [f"{scheme}:{host}" for scheme in SCHEMES]
    names += [f"{scheme}%3A//{host}/x.mp4" for scheme in SCHEMES] + [f" {scheme}://{host}/x" for scheme in SCHEMES]
    return names


def playlists(port):
    """Files that name other files or addresses, by the name that they have."""
    host, there = f"http://127.0.0.1:{port}/x.mp4", "other.mp4"
    hls = "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\n{}\n#EXT-X-ENDLIST\n"
    concat = "ffconcat version 1.0\nfile '{}'\n"
    sdp = "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\n"
    sdp += f"m=video {port} RTP/AVP 96\na=rtpmap:96 H264/90000\n"
    dash = (
        '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011" type="static"><Period><AdaptationSet '
        'contentType="video"><Representation id="1" bandwidth="1"><BaseURL>{}</BaseURL></Representation>'
        "</AdaptationSet></Period></MPD>"
    )
    whole = {"x.m3u8": hls, "x.ffconcat": concat, "x.mpd": dash}
    texts = {
        f"{kind}_{name}": text.format(kind_of)
        for name, text in whole.items()
        for kind, kind_of in (("far", host), ("near", there))
    }
    return texts | {"far_x.sdp": sdp}
