"""A command that serves something on this machine until it is ended."""

import http.client
import signal
import socket
import subprocess
import time
from pathlib import Path


class LocalServer:
    """One that runs. `port`: to be set to that of its address."""

    def __init__(self, test, command, *arguments, environment=None):
        self.test = test
        self.port = None
        self.process = subprocess.Popen([test.program, command, *map(str, arguments)], cwd=test.folder,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
        test.addCleanup(self.kill)

    def line(self):
        """The next line that it prints."""
        return self.process.stdout.readline().strip()

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def ask(self, path, method="GET", host=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.putrequest(method, path, skip_host=True)
        connection.putheader("Host", f"127.0.0.1:{self.port}" if host is None else host)
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        answer.content = answer.read()
        connection.close()
        return answer

    def raw(self, text):
        """The first line of the answer to any bytes."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=20) as connection:
            connection.sendall(text)
            return connection.makefile("rb").readline().decode().strip()

    def listening(self):
        """Where it listens, as Linux has it."""
        lines = [line.split() for table in ("tcp", "tcp6")
                 for line in Path(f"/proc/{self.process.pid}/net/{table}").read_text().splitlines()[1:]]
        return [words[1] for words in lines if words[3] == "0A" and words[1].endswith(f":{self.port:04X}")]

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        begin = time.monotonic()
        code = self.process.wait(20)
        return code, time.monotonic() - begin
