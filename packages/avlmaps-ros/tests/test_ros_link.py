"""Connecting: addresses, who answers, certificates, tokens, what is loaded when, and leaving without a hang."""

import contextlib
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from textwrap import dedent

import pytest

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.extras import install_command
from avlmaps_ros import Frames, RosSettings, open_ros_driver
from avlmaps_ros.link import Link, address

pytestmark = pytest.mark.timeout(90)


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("robot", "ws://robot:9090/"),
        ("robot:9091", "ws://robot:9091/"),
        ("ws://10.0.0.2", "ws://10.0.0.2:9090/"),
        ("ws://[::1]:9090", "ws://[::1]:9090/"),
        ("wss://robot.example/bridge?room=1", "wss://robot.example:443/bridge?room=1"),
    ],
)
def test_an_address_is_completed(given, meant):
    assert address(given) == meant


@pytest.mark.parametrize(
    "given",
    ["", "ws://", "http://robot:9090", "ws://robot:99999", "ws://robot:x", "ws://me:secret@robot", "ro bot", "a\r\nb"],
)
def test_no_address_is_refused_without_trying(given):
    with pytest.raises(NavigationError, match="not an address of a rosbridge") as error:
        address(given)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("url", "token"), [("ws://192.0.2.1:9090", "secret"), ("wss://robot", "two words"), ("wss://r", "")]
)
def test_a_token_is_not_sent_in_the_clear_nor_with_blanks(url, token):
    with pytest.raises(NavigationError, match="token"):
        Link(url, token)


def test_without_autobahn_the_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "avlmaps_ros.wire", None)
    with pytest.raises(BackendError, match=re.escape(install_command(distribution="avlmaps-ros"))):
        open_ros_driver("nav2", "ws://127.0.0.1:9")


def test_without_rclpy_one_sentence_says_what_to_source_and_what_does_without():
    if find_spec("rclpy") is not None:
        pytest.skip("this Python has rclpy; `make test-ros2` tests it")
    with pytest.raises(BackendError, match=r"needs ROS 2's rclpy .*setup.bash.*ros=ws://HOST:9090\.$"):
        open_ros_driver("nav2", "native")
    with pytest.raises(NavigationError, match="in ROS 1, over rosbridge"):
        open_ros_driver("move_base", "native")


@pytest.mark.parametrize("namespace", ["robot 1", "a//b", "/x/$(y)", "1robot", None])
def test_no_namespace_is_refused(namespace):
    with pytest.raises(NavigationError, match="not a ROS namespace"):
        RosSettings(namespace=namespace)


@pytest.mark.parametrize("name", ["goal_timeout_s", "speed_m_s", "reached_m"])
@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf"), True, "0.3", None])
def test_no_setting_is_refused(name, bad):
    with pytest.raises(NavigationError, match="it is a number from"):
        RosSettings(**{name: bad})


def test_one_frame_for_both_is_refused():
    with pytest.raises(NavigationError, match="both"):
        Frames("base_link", "base_link")


def test_a_process_loads_twisted_only_to_connect_and_ends_without_a_word_though_it_never_closes_its_driver():
    code = """
        import sys
        from avlmaps_ros import open_ros_driver
        loaded = sorted(set(sys.modules) & {"twisted", "autobahn", "torch"})
        assert not loaded, loaded
        from ros_bridge import FakeRobot
        import numpy as np
        robot = FakeRobot(2).__enter__()
        driver = open_ros_driver("nav2", robot.url)
        assert driver.go_to(np.array([1.0, 0.0, 0.0])).reached
        print("done")
    """
    paths = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", dedent(code)],
        capture_output=True,
        text=True,
        timeout=80,
        check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "done", "")


class TestListening:
    """Against sockets of the test's own."""

    def test_nobody_there_says_how_to_start_the_bridge(self):
        import socket

        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            port = unused.getsockname()[1]
        with pytest.raises(NavigationError, match="ros2 launch rosbridge_server") as error:
            open_ros_driver("nav2", f"ws://127.0.0.1:{port}")
        assert "refused" in str(error.value)

    @pytest.mark.parametrize("says", [b"", b"SSH-2.0-OpenSSH_9.6\r\n", b"HTTP/1.1 404 Not Found\r\n\r\n"])
    def test_something_else_there_is_told_of_within_the_timeout(self, says):
        import socket
        import threading

        with socket.create_server(("127.0.0.1", 0)) as server:

            def answer() -> None:
                client, _ = server.accept()
                with client, contextlib.suppress(OSError):
                    client.recv(1000)
                    client.sendall(says)
                    client.recv(1000)

            threading.Thread(target=answer, daemon=True).start()
            port = server.getsockname()[1]
            with pytest.raises(NavigationError, match="No rosbridge answers"):
                open_ros_driver("nav2", f"ws://127.0.0.1:{port}", settings=RosSettings(connect_timeout_s=1.0))

    def test_a_token_goes_to_this_machine_as_a_header(self, monkeypatch):
        from ros_bridge import FakeRobot

        monkeypatch.setenv("AVLMAPS_ROS_TOKEN", "from-outside")
        with FakeRobot(2) as robot:
            with open_ros_driver("nav2", robot.url, token="s3cret"):
                assert robot.headers["authorization"] == "Bearer s3cret"
            with open_ros_driver("nav2", robot.url):
                assert robot.headers["authorization"] == "Bearer from-outside"

    def test_a_certificate_that_nobody_signed_is_refused(self, tmp_path):
        import socket
        import ssl
        import threading

        certificate = self_signed(tmp_path)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate)
        shaken = []
        with socket.create_server(("127.0.0.1", 0)) as server:

            def answer() -> None:
                client, _ = server.accept()
                try:
                    with context.wrap_socket(client, server_side=True) as secure:
                        shaken.append(secure.recv(10))
                except OSError:
                    shaken.append(b"")

            thread = threading.Thread(target=answer, daemon=True)
            thread.start()
            port = server.getsockname()[1]
            with pytest.raises(NavigationError, match="certificate"):
                Link(f"wss://localhost:{port}", timeout_s=3.0)
            thread.join(5.0)
        assert shaken in ([], [b""])  # not a byte of the handshake of the bridge went over


def self_signed(folder: Path) -> Path:
    from datetime import UTC, datetime, timedelta

    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    now = datetime.now(UTC)
    built = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
        .sign(key, hashes.SHA256())
    )
    path = folder / "self.pem"
    path.write_bytes(
        built.public_bytes(serialization.Encoding.PEM)
        + key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    return path
