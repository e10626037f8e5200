"""The settings in docs/web.md work with Debian's nginx and Apache: files are read, and browsers may read them.

A server that is not installed is skipped with a message."""

import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import time
import unittest
import urllib.error
import urllib.request

from program import ProgramTest

DOCUMENT = pathlib.Path(__file__).resolve().parents[3] / "docs" / "web.md"
LISTS = {"Access-Control-Allow-Headers": {"range", "if-range", "if-match"},
         "Access-Control-Expose-Headers": {"content-range", "content-length", "accept-ranges", "etag"}}


def settings(language):
    return re.search(rf"```{language}\n(.*?)```", DOCUMENT.read_text(), re.S)[1]


def program(name, package):
    found = shutil.which(name, path="/usr/sbin:/usr/bin:" + os.environ.get("PATH", ""))
    if found is None:
        print(f"there is no {name} on this machine ({package}), so its settings are not tested", flush=True)
        raise unittest.SkipTest(f"no {name}")
    return found


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def list_of(value):
    return {word.strip().lower() for word in (value or "").split(",")}


class Servers(ProgramTest):
    def setUp(self):
        super().setUp()
        # A server that root starts reads files as another user.
        self.folder.chmod(0o755)
        self.tagrid("phantom", "--dims", "150,140,130", "-o", "scan.nhdr")
        self.tagrid("encode", "scan.nhdr", "--max-error", "2", "-o", "scan.tag")
        # Apache's entity tags are weak for files that have just changed.
        os.utime(self.folder / "scan.tag", (10**9, 10**9))
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}/scan.tag"

    def start(self, *command):
        server = subprocess.Popen(list(map(str, command)), cwd=self.folder, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE)

        def stop():
            server.terminate()
            server.wait(20)
            server.stderr.close()

        self.addCleanup(stop)
        for _ in range(200):
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                return
            except OSError:
                self.assertIsNone(server.poll(), server.stderr.read() if server.poll() is not None else "")
                time.sleep(0.05)
        self.fail("the server does not answer")

    def answer(self, method="GET", **headers):
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(urllib.request.Request(self.url, method=method, headers=headers)) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.headers, error.read()

    def check(self):
        environment = {name: value for name, value in os.environ.items() if not name.lower().endswith("_proxy")}
        for arguments in ([], ["--region", "60:140,:,30:70"]):
            far = self.tagrid("decode", self.url, *arguments, "-o", "-", env=environment).stdout
            self.assertEqual(far, self.tagrid("decode", "scan.tag", *arguments, "-o", "-").stdout)
        self.assertIn("404", self.tagrid("info", self.url + ".tag", code=74, env=environment).stderr.decode())
        # As a browser asks that would like compressed bytes.
        data = (self.folder / "scan.tag").read_bytes()
        status, headers, body = self.answer(Range="bytes=100-299", Origin="https://example.org",
                                            Accept_Encoding="gzip, br")
        self.assertEqual((status, body), (206, data[100:300]))
        self.assertEqual(headers["Content-Range"], f"bytes 100-299/{len(data)}")
        self.assertIsNone(headers["Content-Encoding"])
        self.assertTrue(headers["ETag"].startswith('"'), headers["ETag"])
        self.assertEqual(headers["Access-Control-Allow-Origin"], "*")
        self.assertEqual(list_of(headers["Access-Control-Expose-Headers"]), LISTS["Access-Control-Expose-Headers"])
        status, again, body = self.answer(Range="bytes=0-9", If_Match=headers["ETag"])
        self.assertEqual((status, body), (206, data[:10]))
        status, again, _ = self.answer(Range="bytes=0-9", If_Match='"another"', Origin="https://example.org")
        self.assertEqual(status, 412)
        self.assertEqual(again["Access-Control-Allow-Origin"], "*")
        # What a browser asks before that.
        status, headers, _ = self.answer("OPTIONS", Origin="https://example.org", Access_Control_Request_Method="GET",
                                         Access_Control_Request_Headers="range, if-match")
        self.assertIn(status, (200, 204))
        self.assertEqual(list_of(headers["Access-Control-Allow-Headers"]), LISTS["Access-Control-Allow-Headers"])
        self.assertEqual(headers["Access-Control-Allow-Origin"], "*")
        self.assertIn("get", list_of(headers["Access-Control-Allow-Methods"]))

    def test_the_settings_of_nginx(self):
        nginx = program("nginx", "nginx")
        block = settings("nginx")
        (self.folder / "nginx.conf").write_text(f"""
            daemon off;
            pid {self.folder}/nginx.pid;
            error_log stderr;
            events {{ }}
            http {{
                access_log off;
                client_body_temp_path {self.folder}/a; proxy_temp_path {self.folder}/b;
                fastcgi_temp_path {self.folder}/c; uwsgi_temp_path {self.folder}/d; scgi_temp_path {self.folder}/e;
                gzip on; gzip_types *; gzip_min_length 1;
                server {{
                    listen 127.0.0.1:{self.port};
                    root {self.folder};
                    {block}
                }}
            }}""")
        self.start(nginx, "-p", self.folder, "-c", self.folder / "nginx.conf", "-e", "stderr")
        self.check()

    def test_the_settings_of_apache(self):
        apache = program("apache2", "apache2")
        modules = pathlib.Path("/usr/lib/apache2/modules")
        loaded = "\n".join(f"LoadModule {name}_module {modules}/mod_{name}.so"
                           for name in ("mpm_event", "authz_core", "headers", "deflate", "filter", "env", "mime"))
        (self.folder / "apache.conf").write_text(f"""
            ServerRoot {self.folder}
            ServerName 127.0.0.1
            Listen 127.0.0.1:{self.port}
            PidFile {self.folder}/apache.pid
            ErrorLog /dev/stderr
            {loaded}
            TypesConfig /dev/null
            User www-data
            Group www-data
            DocumentRoot {self.folder}
            SetOutputFilter DEFLATE
            <Directory {self.folder}>
                Require all granted
                {settings("apache")}
            </Directory>""")
        self.start(apache, "-f", self.folder / "apache.conf", "-DFOREGROUND")
        self.check()

    def test_the_rules_of_buckets_say_the_same(self):
        rule, = json.loads(settings("json"))["CORSRules"]
        self.assertEqual({name.lower() for name in rule["AllowedHeaders"]}, LISTS["Access-Control-Allow-Headers"])
        self.assertEqual({name.lower() for name in rule["ExposeHeaders"]}, LISTS["Access-Control-Expose-Headers"])


if __name__ == "__main__":
    unittest.main()
