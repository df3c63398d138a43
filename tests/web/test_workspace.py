"""What becomes of uploads: frames, calibrations, and files that mean harm."""

import hashlib
import io
import json
import shutil
import struct
import sys
import time
import zipfile
import zlib
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from web_client import PATIENCE, Client, serving

from chartless import load
from chartless.cli import main
from chartless.web import Limits, _app


def png_claiming(width: int, height: int) -> bytes:
    """A PNG file whose header says so, with a few bytes of pixels."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        check = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixels = zlib.compress(b"\0" * 1_000_000)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", pixels), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def folder_of(client: Client, desk: Path) -> Path:
    """Where a browser's files are kept: of all folders that with the file it gives."""
    png = png_claiming(1, 1)
    key = client.put("which.png", png).json["id"]
    (path,) = desk.rglob("which.png")
    client.ask("DELETE", f"/api/files/{key}")
    return path.parent


def zip_bomb() -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("frame.png", b"\0" * 50_000_000)
    return packed.getvalue()


class TestHarm:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        "name",
        [
            "../../escape.png", "..\\..\\escape.png", "/etc/escape.png", "C:\\escape.png",
            ".escape.png", "a/../../escape.png", "esc\napé.png", "..", ".", "", " ", "x" * 5000,
            "%2e%2e%2fescape.png", "-rf.png", "nul\0l.png", "日" * 300 + ".png", "a." + "é" * 300,
        ],
    )  # fmt: skip
    def test_a_name_is_never_a_path(
        self, client: Client, desk: Path, frames: list[Path], name: str
    ) -> None:
        before = set(desk.parent.rglob("*"))
        answer = client.put(name, frames[0].read_bytes())

        assert answer.status == 201
        (file,) = client.state["files"]
        assert "/" not in file["name"]
        assert "\\" not in file["name"]
        assert not file["name"].startswith(".")
        (kept,) = set(desk.parent.rglob("*")) - before
        assert kept.parent == folder_of(client, desk)
        assert kept.name == file["name"]

    @pytest.mark.parametrize("name", ["a.png", "日" * 100 + ".png"])
    def test_equal_names_are_two_files(self, client: Client, frames: list[Path], name: str) -> None:
        for path in frames:
            assert client.put(name, path.read_bytes()).status == 201

        second, first = (Path(each["name"]) for each in client.state["files"])
        assert second.stem == f"{first.stem} (2)"
        assert first.suffix == second.suffix == ".png"

    def test_a_link_in_the_way_is_not_followed(
        self, client: Client, desk: Path, frames: list[Path], tmp_path: Path
    ) -> None:
        target = tmp_path / "precious.png"
        (folder_of(client, desk) / "a.png").symlink_to(target)
        answer = client.put("a.png", frames[0].read_bytes())

        assert answer.status == 507
        assert "make room" not in answer.error
        assert not target.exists()

    @pytest.mark.parametrize(
        ("name", "content", "words"),
        [
            ("notes.txt", b"hello", "notes.txt: is not a picture"),
            ("empty.png", b"", "empty.png: is empty"),
            ("bomb.png", zip_bomb(), "bomb.png: is not a picture"),
            ("bomb.zip", zip_bomb(), "bomb.zip: is not a picture"),
            ("huge.png", png_claiming(60_000, 60_000), "huge.png: claims to be larger"),
            ("large.png", png_claiming(20_000, 20_000), "larger than this page takes"),
            ("bent.png", b"\x89PNG\r\n\x1a\n" + b"?" * 50, "bent.png: is damaged"),
            ("bent.cube", b"LUT_1D_SIZE 256\n0 0 0\n", "bent.cube"),
            ("bent.json", b'{"format": "chartless-calibration"', "bent.json"),
            ("bent.cr2", b"II*\0" + b"?" * 50, "bent.cr2"),
        ],
    )
    def test_what_is_no_frame_is_refused_in_a_line(
        self, client: Client, name: str, content: bytes, words: str
    ) -> None:
        answer = client.put(name, content)

        if answer.status == 201:  # a damaged calibration is found out by the process that reads it
            text = client.finished(answer.json["id"])["error"]
        else:
            assert answer.status == 422
            text = answer.error
            assert client.state == {"files": [], "cameras": []}
        assert words in text
        assert "\n" not in text
        assert "/tmp" not in text
        assert "files/" not in text

    @pytest.mark.slow
    @pytest.mark.skipif(sys.platform != "linux", reason="needs RLIMIT_AS")
    def test_a_process_may_not_take_all_memory(self, tmp_path: Path, frames: list[Path]) -> None:
        """Two pictures are too large; for others there is room again."""
        large = io.BytesIO()
        Image.fromarray(np.zeros((9000, 9000, 3), np.uint8)).save(large, "PNG", compress_level=1)
        with serving(tmp_path, limits=Limits(worker_bytes=700_000_000)) as nobody:
            client = nobody.begin()
            for name in ("a.png", "b.png"):
                assert client.put(name, large.getvalue()).status == 201
            key = client.ask("POST", "/api/cameras", {}).json["id"]
            assert "memory" in client.finished(key)["error"]

            client.ask("DELETE", "/api/files")
            for path in frames:
                client.put(path.name, path.read_bytes())
            key = client.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
            assert client.finished(key)["state"] == "done"

    def test_a_disk_that_is_full(self, client: Client, desk: Path) -> None:
        resource = pytest.importorskip("resource")
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
        try:
            answer = client.put("a.png", bytes(1_000_000))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

        assert answer.status == 507
        assert "make room" in answer.error
        assert "/" not in answer.error
        assert not any(folder_of(client, desk).iterdir())


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "bmp", "ppm", "pgm", "webp"])
def test_pictures_of_all_kinds_are_frames(client: Client, suffix: str) -> None:
    levels = np.random.default_rng(1).integers(0, 255, (40, 50), dtype=np.uint8)
    picture = Image.fromarray(levels)
    kinds = {"jpg": "jpeg", "tif": "tiff", "pgm": "ppm"}
    content = io.BytesIO()
    picture.save(content, kinds.get(suffix, suffix))
    answer = client.put(f"_DSC0001.{suffix}", content.getvalue())

    assert answer.status == 201, answer.error
    assert [each["kind"] for each in client.state["files"]] == ["picture"]


class TestLimits:
    def test_a_file_too_large(self, strict_client: Client) -> None:
        answer = strict_client.put("a.png", bytes(200_001))

        assert answer.status == 413
        assert "0.2 MB" in answer.error
        assert strict_client.state["files"] == []

    @pytest.mark.slow
    def test_too_much_together_and_room_again(
        self, strict_client: Client, frames: list[Path]
    ) -> None:
        content = frames[0].read_bytes()
        padded = content + bytes(190_000 - len(content))
        answers = [strict_client.put(f"{name}.png", padded) for name in "abc"]

        assert [each.status for each in answers] == [201, 201, 413]
        strict_client.ask("DELETE", f"/api/files/{answers[0].json['id']}")
        assert strict_client.put("c.png", padded).status == 201

    def test_files_that_arrive_at_once_share_the_room(self, tmp_path: Path) -> None:
        """Two files are still on their way: with a third it would be too much."""
        limits = Limits(file_bytes=200_000, total_bytes=500_000)
        with serving(tmp_path, limits=limits) as nobody, ExitStack() as open_ones:
            strict_client = nobody.begin()
            for name in "ab":
                open_ones.enter_context(strict_client.half_sent(name, 199_000, bytes(190_000)))
            while sum(each.stat().st_size for each in tmp_path.rglob("files/*")) < 370_000:
                time.sleep(0.01)
            answer = strict_client.put("c.png", bytes(199_000))

        assert answer.status == 413

    def test_a_file_of_which_the_rest_does_not_come(
        self, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(_app, "_PATIENCE", 0.2)
        with client.half_sent("a.png", 1000, b"1") as connection:
            connection.settimeout(PATIENCE)
            assert connection.recv(100).startswith(b"HTTP/1.1 408 ")

    @pytest.mark.slow
    def test_a_calibration_too_large(self, tmp_path: Path) -> None:
        limits = Limits(calibration_bytes=1000)
        with serving(tmp_path, limits=limits) as nobody:
            table = "".join(f"{k / 255} {k / 255} {k / 255}\n" for k in range(256))
            answer = nobody.begin().put("a.cube", f"LUT_1D_SIZE 256\n{table}".encode())

        assert answer.status == 422
        assert "larger than any calibration" in answer.error

    @pytest.mark.slow
    def test_too_many_files(self, strict_client: Client, frames: list[Path]) -> None:
        content = frames[0].read_bytes()
        statuses = [strict_client.put(f"{name}.png", content).status for name in "abcd"]

        assert statuses == [201, 201, 201, 413]

    @pytest.mark.slow
    def test_too_many_results(self, strict_client: Client, frames: list[Path]) -> None:
        for path in frames:
            strict_client.put(path.name, path.read_bytes())
        answers = [
            strict_client.ask("POST", "/api/cameras", {"method": method})
            for method in ("", "nlf", "ism-bin")
        ]

        assert [each.status for each in answers] == [202, 202, 413]
        assert "remove some" in answers[-1].error

    def test_options_too_long(self, client: Client) -> None:
        assert client.ask("POST", "/api/cameras", b" " * 20_000).status == 413

    @pytest.mark.parametrize("content", [b"", b"[]", b"{", b"[" * 5000, b"\xff"])
    def test_options_of_another_kind(self, client: Client, content: bytes) -> None:
        assert client.ask("POST", "/api/cameras", content).status == 400

    def test_browsers_beyond_the_last_replace_the_quietest(self, tmp_path: Path) -> None:
        limits = Limits(sessions=2, quiet_seconds=0)
        with serving(tmp_path, limits=limits) as nobody:
            first, second, third = (Client(nobody.port).begin() for _ in range(3))

            assert first.ask("GET", "/api/state").status == 401
            assert second.state == third.state == {"files": [], "cameras": []}
            assert len([*tmp_path.iterdir()]) == 2

            with second.half_sent("a", 1000, b"1"):
                while not any(tmp_path.rglob("a")):
                    time.sleep(0.01)
                Client(nobody.port).begin()
                assert second.ask("GET", "/api/state").status == 200
                assert third.ask("GET", "/api/state").status == 401

    def test_many_new_browsers_do_not_turn_out_one_at_work(self, tmp_path: Path) -> None:
        with serving(tmp_path, limits=Limits(sessions=2)) as nobody:
            clients = [Client(nobody.port).begin() for _ in range(2)]
            answer = Client(nobody.port).ask("POST", "/api/session")

            assert answer.status == 413
            assert "try again later" in answer.error
            assert all(each.ask("GET", "/api/state").status == 200 for each in clients)


class TestCalibrations:
    @pytest.fixture
    def given(self, client: Client, frames: list[Path]) -> Client:
        for path in reversed(frames):
            assert client.put(path.name, path.read_bytes()).status == 201
        return client

    def test_the_file_is_that_of_the_command_line(
        self,
        given: Client,
        frames: list[Path],
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        camera = given.finished(key)
        monkeypatch.chdir(frames[0].parent)
        names = [path.name for path in frames]
        assert main(["calibrate", *names, "--method", "nlf", "-o", f"{tmp_path}/c.json"]) == 0

        assert camera["state"] == "done"
        answer = given.ask("GET", f"/api/cameras/{key}/camera.json")
        ours, theirs = answer.json, json.loads((tmp_path / "c.json").read_text())
        for each in (ours, theirs):
            assert each["provenance"].pop("created")
        assert ours == theirs
        assert "attachment" in answer.headers["content-disposition"]

    @pytest.mark.slow
    def test_an_export_is_that_of_the_command_line(self, given: Client, tmp_path: Path) -> None:
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        given.finished(key)
        own = tmp_path / "camera.json"
        own.write_bytes(given.ask("GET", f"/api/cameras/{key}/camera.json").body)
        for name, suffix in (("cube", ".cube"), ("clf", ".clf"), ("opencv", ".yml")):
            assert main(["export", str(own), "--to", name, "-o", f"{tmp_path}/x{suffix}"]) == 0
            answer = given.ask("GET", f"/api/cameras/{key}/export/{name}")

            assert answer.body == (tmp_path / f"x{suffix}").read_bytes()
            assert f"camera{suffix}" in answer.headers["content-disposition"]
            assert "band" in answer.headers["x-lost"]

    @pytest.mark.slow
    def test_of_several_files_an_archive(self, given: Client) -> None:
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        given.finished(key)
        answer = given.ask("GET", f"/api/cameras/{key}/export/dso")

        with zipfile.ZipFile(io.BytesIO(answer.body)) as archive:
            assert sorted(archive.namelist()) == ["camera.txt", "vignette.png"]

    @pytest.mark.slow
    def test_the_report_is_its_own_and_may_run_nothing(self, given: Client) -> None:
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        given.finished(key)
        answer = given.ask("GET", f"/api/cameras/{key}/report.html")

        assert "A frame before and after" in answer.body.decode()
        assert "sandbox" in answer.headers["content-security-policy"]
        assert "content-disposition" not in answer.headers
        kept = given.ask("GET", f"/api/cameras/{key}/report.html?keep")
        assert "report.html" in kept.headers["content-disposition"]

    def test_a_calibration_given_is_a_result(
        self, client: Client, tmp_path: Path, data_path: Path
    ) -> None:
        sample = next((data_path / "format_samples").rglob("*.cube"))
        answer = client.put(sample.name, sample.read_bytes())

        assert answer.json["is_camera"]
        camera = client.finished(answer.json["id"])
        assert camera["state"] == "done", camera["error"]
        assert camera["title"] == sample.name
        assert client.state["files"] == []
        own = client.ask("GET", f"/api/cameras/{camera['id']}/camera.json")
        (tmp_path / "c.json").write_bytes(own.body)
        assert load(tmp_path / "c.json").channels

    @pytest.mark.slow
    def test_a_calibration_given_opens_no_file_that_it_names(
        self, client: Client, given: Client, frames: list[Path]
    ) -> None:
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        given.finished(key)
        content = given.ask("GET", f"/api/cameras/{key}/camera.json").json
        for each, path in zip(content["provenance"]["inputs"], frames, strict=True):
            each["file"] = str(path)  # with its true digest
        planted = client.put("planted.json", json.dumps(content).encode()).json["id"]

        assert client.finished(planted)["state"] == "done"
        page = client.ask("GET", f"/api/cameras/{planted}/report.html").body.decode()
        assert "A frame before and after" not in page

    def test_a_file_of_another_program_is_known_by_its_name(
        self, client: Client, desk: Path
    ) -> None:
        """And not by where it lay on this computer."""
        table = "".join(f"{k / 255} {k / 255} {k / 255}\n" for k in range(256))
        key = client.put("given.cube", f"LUT_1D_SIZE 256\n{table}".encode()).json["id"]
        assert client.finished(key)["state"] == "done"
        file = client.ask("GET", f"/api/cameras/{key}/camera.json")

        assert file.json["provenance"]["inputs"][0]["file"] == "given.cube"
        assert str(desk).encode() not in file.body

    @pytest.mark.slow
    def test_what_was_made_already_is_not_made_again(self, given: Client) -> None:
        first, again, other = (
            given.ask("POST", "/api/cameras", {"method": "nlf", **options}).json["id"]
            for options in ({}, {"model": ""}, {"shared_noise": True})
        )
        assert again == first
        assert other != first
        assert given.finished(first)["state"] == "done"
        assert given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"] == first

        file = given.state["files"][0]["id"]
        given.ask("PATCH", f"/api/files/{file}", {"role": "dark"})
        with_cap = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        assert with_cap != first
        assert given.finished(with_cap)["state"] == "failed"
        assert given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"] != with_cap

    @pytest.mark.slow
    def test_what_was_chosen_is_in_the_title(self, given: Client) -> None:
        options = {
            "method": "nlf", "model": "", "channels": "luma", "evidence": "noise", "times": "1,2",
            "shared_noise": True, "unaligned": "", "jobs": 99,
        }  # fmt: skip
        key = given.ask("POST", "/api/cameras", options).json["id"]
        camera = given.finished(key)

        words = "nlf, luma, evidence noise, times 1, 2, shared noise"
        assert camera["title"].endswith(f" and 1 more, {words}")
        chosen = {name: options[name] for name in ("method", "channels", "evidence")}
        assert camera["options"] == {**chosen, "times": "1, 2", "shared_noise": True}

    @pytest.mark.slow
    def test_several_are_compared(self, given: Client) -> None:
        keys = [
            given.ask("POST", "/api/cameras", {"method": "nlf", **options}).json["id"]
            for options in ({"channels": "luma"}, {"channels": "luma", "evidence": "noise"})
        ]
        for key in keys:
            given.finished(key)
        page = given.ask("GET", f"/api/comparison?cameras={','.join(keys)}").body.decode()

        assert page.count("<tr>") == 3
        assert "<td>0.000</td>" in page
        assert "<svg" in page
        assert given.ask("GET", "/api/comparison?cameras=1,2").status == 404

    @pytest.mark.slow
    def test_one_is_given_up_while_it_is_made(self, given: Client) -> None:
        key = given.ask("POST", "/api/cameras", {}).json["id"]
        assert given.state["cameras"][0]["state"] == "running"

        assert given.ask("DELETE", f"/api/cameras/{key}").status == 204
        assert given.state["cameras"] == []
        assert given.ask("GET", f"/api/cameras/{key}/report.html").status == 404

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"method": "magic"}, "unknown method 'magic'"),
            ({"model": "magic"}, "unknown model 'magic'"),
            ({"times": "1,2,4"}, "3"),
            ({"times": "/etc/passwd"}, "numbers or fractions"),
            ({"times": "1,zwei"}, "numbers or fractions"),
            ({"evidence": "bracket"}, "exposure"),
            ({"method": "debevec"}, "exposure"),
            ({"channels": "rgb"}, "is grey"),
        ],
    )
    def test_what_is_wrong_is_said(
        self, given: Client, options: dict[str, str], words: str
    ) -> None:
        answer = given.ask("POST", "/api/cameras", options)
        text = answer.error if answer.status == 422 else given.finished(answer.json["id"])["error"]

        assert words in text
        assert "\n" not in text
        assert "root:" not in text

    @pytest.mark.slow
    def test_files_may_be_removed_while_they_are_read(
        self, given: Client, frames: list[Path], desk: Path
    ) -> None:
        """And others of their names are not read in their place."""
        key = given.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]
        given.ask("DELETE", "/api/files")
        for path in frames:
            given.put(path.name, frames[0].read_bytes())

        assert given.finished(key)["state"] == "done"
        provenance = given.ask("GET", f"/api/cameras/{key}/camera.json").json["provenance"]
        digests = {hashlib.sha256(path.read_bytes()).hexdigest() for path in frames}
        assert {each["sha256"] for each in provenance["inputs"]} == digests
        folder = desk.glob(f"*/camera-{key}")
        assert sorted(each.name for each in next(folder).iterdir()) == [
            "camera.json", "report.html",
        ]  # fmt: skip

    def test_a_result_removed_while_it_is_asked_for(self, client: Client, desk: Path) -> None:
        """Also then no path of this computer is told, and no disk is full."""
        key = client.put("a.cube", b"LUT_1D_SIZE 2\n0 0 0\n1 1 1\n").json["id"]
        assert client.finished(key)["state"] == "done"
        shutil.rmtree(next(desk.glob(f"*/camera-{key}")))

        for name in ("camera.json", "report.html", "export/cube"):
            answer = client.ask("GET", f"/api/cameras/{key}/{name}")
            assert (answer.status, answer.error) == (404, "It was removed in the meantime.")

    @pytest.mark.slow
    def test_files_removed_take_room_as_long_as_they_are_read(
        self, strict_client: Client, frames: list[Path]
    ) -> None:
        padded = [path.read_bytes().ljust(190_000, b"\0") for path in frames]
        for place, content in enumerate(padded):
            strict_client.put(f"{place}.png", content)
        key = strict_client.ask("POST", "/api/cameras", {"method": "ism-bin"}).json["id"]
        strict_client.ask("DELETE", "/api/files")
        status = strict_client.put("c.png", padded[0]).status
        strict_client.ask("DELETE", f"/api/cameras/{key}")

        assert status == 413
        assert strict_client.put("c.png", padded[0]).status == 201

    @pytest.mark.slow
    def test_nothing_but_options_of_the_page_is_passed_on(self, given: Client) -> None:
        options = {"dark": ["/etc/passwd"], "mask": "/etc/passwd", "jobs": 99, "frames": ["/x"]}
        key = given.ask("POST", "/api/cameras", {"method": "nlf", **options}).json["id"]

        assert given.finished(key)["state"] == "done"

    def test_without_frames(self, client: Client) -> None:
        assert "no frames yet" in client.ask("POST", "/api/cameras", {}).error

    @pytest.mark.slow
    def test_frames_left_out_and_lens_caps(self, given: Client, frames: list[Path]) -> None:
        dark = np.random.default_rng(1).integers(0, 6, (2, 240, 320)).astype(np.uint8)
        for number, levels in enumerate(dark):
            picture = io.BytesIO()
            Image.fromarray(levels).save(picture, "PNG")
            file = given.put(f"cap_{number}.png", picture.getvalue()).json["id"]
            path = f"/api/files/{file}"
            assert given.ask("PATCH", path, {"role": "dark"}).status == 204
            assert given.ask("PATCH", path, {"role": "nonsense"}).status == 404
        unused = given.put("z.png", frames[0].read_bytes()).json["id"]
        given.ask("PATCH", f"/api/files/{unused}", {"role": "unused"})
        key = given.ask("POST", "/api/cameras", {}).json["id"]

        assert given.finished(key)["state"] == "done"
        provenance = given.ask("GET", f"/api/cameras/{key}/camera.json").json["provenance"]
        assert provenance["settings"]["dark"] == ["cap_0.png", "cap_1.png"]
        assert [each["file"] for each in provenance["inputs"]] == ["shot_1.png", "shot_2.png"]


@pytest.mark.slow
def test_files_that_a_browser_gave_are_nobody_elses(tmp_path: Path, frames: list[Path]) -> None:
    with serving(tmp_path) as nobody:
        client = nobody.begin()
        client.put("a.png", frames[0].read_bytes())

        for folder in (path for path in tmp_path.rglob("*") if path.is_dir()):
            assert folder.stat().st_mode & 0o077 == 0


@pytest.mark.slow
def test_a_file_called_like_a_module_is_not_run(tmp_path: Path, frames: list[Path]) -> None:
    """Workers run where uploads lie."""
    with serving(tmp_path) as nobody:
        client = nobody.begin()
        (files,) = tmp_path.glob("*/files")
        for name in ("numpy", "json", "chartless", "sitecustomize"):
            (files / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
        for path in frames:
            client.put(path.name, path.read_bytes())
        key = client.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]

        assert client.finished(key)["state"] == "done"
    assert not (tmp_path / "ran").exists()
