"""A real Signal K server (npm's signalk-server), where there is one: $SIGNALK_SERVER names its program."""

import asyncio
import contextlib
import json
import os
import shutil
import subprocess
import time
import urllib.error
import urllib.request

from sitl.scenario.traffic import free_port

PROGRAM = os.environ.get("SIGNALK_SERVER") or shutil.which("signalk-server")
MISSING = (
    "no Signal K server: `npm install --prefix DIR signalk-server`, and set $SIGNALK_SERVER to "
    "DIR/node_modules/.bin/signalk-server"
)
SECRET = "a secret of the tests"  # of its tokens
START_S = 60.0


class Server:
    """A server with a folder of its own; ``http``, ``ws`` and ``tcp`` are how it is reached."""

    def __init__(self, folder, *, is_secure=False, nmea_port=None):
        self._folder, self._process = folder, None
        self.port, self._tcp_port = free_port(), free_port()
        folder.mkdir(parents=True, exist_ok=True)
        settings = {"interfaces": {}, "mdns": False, "vessel": {"mmsi": "366982320"}}
        if nmea_port is not None:
            settings["pipedProviders"] = [
                {
                    "id": "nmea",
                    "enabled": True,
                    "pipeElements": [
                        {
                            "type": "providers/simple",
                            "options": {
                                "type": "NMEA0183",
                                "subOptions": {"type": "udp", "port": str(nmea_port)},
                                "logging": False,
                            },
                        }
                    ],
                }
            ]
        if is_secure:
            settings["security"] = {"strategy": "./tokensecurity"}
            (folder / "security.json").write_text(
                json.dumps(
                    {
                        "allow_readonly": True,
                        "expiration": "NEVER",
                        "secretKey": SECRET,
                        "users": [
                            {"username": "boat", "type": "readwrite", "password": "x"},
                            {"username": "guest", "type": "readonly", "password": "x"},
                        ],
                        "devices": [],
                        "immutableConfig": False,
                        "acls": [],
                        "allowDeviceAccessRequests": False,
                        "allowNewUserRegistration": False,
                    }
                )
            )
            (folder / "security.json").chmod(0o600)
        (folder / "settings.json").write_text(json.dumps(settings))

    @property
    def ws(self):
        return f"ws://127.0.0.1:{self.port}"

    @property
    def tcp(self):
        return f"tcp:127.0.0.1:{self._tcp_port}"

    def start(self):
        with (self._folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [PROGRAM],
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=self._folder,
                env={
                    **os.environ,
                    "PORT": str(self.port),
                    "TCPSTREAMPORT": str(self._tcp_port),
                    "SIGNALK_NODE_CONFIG_DIR": str(self._folder),
                    "EXTERNALHOST": "127.0.0.1",
                },
            )
        until_s = time.monotonic() + START_S
        while time.monotonic() < until_s and self._process.poll() is None:
            with contextlib.suppress(OSError):
                self.get("")
                return self
            time.sleep(0.2)
        self.stop()
        raise AssertionError(f"the Signal K server did not start: {(self._folder / 'log').read_text()[-800:]}")

    def stop(self):
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self):
        return self.start()

    def __exit__(self, *_):
        self.stop()

    def token(self, user):
        """Make a token as `signalk-generate-token` does."""
        import base64
        import hashlib
        import hmac

        def part(data):
            return base64.urlsafe_b64encode(data).rstrip(b"=")

        body = b".".join(
            part(json.dumps(d).encode())
            for d in ({"alg": "HS256", "typ": "JWT"}, {"id": user, "exp": int(time.time()) + 3600})
        )
        return (body + b"." + part(hmac.digest(SECRET.encode(), body, hashlib.sha256))).decode()

    def get(self, path, version=1):
        """Return what the REST API has at a path of our own vessel, None: nothing."""
        url = f"http://127.0.0.1:{self.port}/signalk"
        url = f"{url}/v{version}/api/vessels/self/{path.replace('.', '/')}" if path else url
        try:
            with urllib.request.urlopen(url, timeout=5.0) as answer:
                return json.loads(answer.read())
        except urllib.error.HTTPError as error:
            if error.code == 404:
                return None
            raise

    async def value(self, path, *, within_s=10.0, until=lambda value: value is not None):
        """Return the value at a path as soon as it is as wanted."""
        value = None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(within_s):
                while True:
                    told = await asyncio.to_thread(self.get, path)
                    value = told.get("value") if isinstance(told, dict) else None
                    if until(value):
                        return value
                    await asyncio.sleep(0.1)
        raise AssertionError(f"{path} is {value!r}")
