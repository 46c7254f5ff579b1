"""A video is a file that holds its own pictures: no name and no playlist makes anything else be opened."""

import os
import socket
from threading import Event, Thread

import pytest

from airborne.errors import VideoError
from airborne.sync.audio import read_sound
from airborne.video import VideoSource, connect, inspect, open_recording
from airborne.video.sources import open_source
from tests.support.canary import canary, hostile_names, playlists
from tests.support.clips import numbered, numbers_of, plain_rig, write_clip


def test_a_name_like_an_address_is_the_file_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with canary() as watch:
        for begin in (
            f"http:/127.0.0.1:{watch.port}",
            f"tcp:/127.0.0.1:{watch.port}",
            "subfile:,,start,9,end,99,,:",
            "pipe:0",
        ):
            (tmp_path / begin).mkdir(parents=True)
            source = VideoSource("cam1", write_clip(tmp_path / begin / "x.mkv", numbered(3)).relative_to(tmp_path))
            frames = list(open_recording([source], plain_rig("cam1")))
            assert [numbers_of(each.views) for each in frames] == [[0], [1], [2]]
            with pytest.raises(VideoError, match="has no sound"):
                read_sound(source)
    assert watch.n_requests == 0


def test_playlists_open_nothing_whatever_they_are_called(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_clip(tmp_path / "other.mp4", numbered(3), codec="libx264", pix_fmt="yuv420p")
    with canary() as watch:
        for name, text in playlists(watch.port).items():
            for called in (name, f"{name}.mp4", name.rpartition(".")[0]):
                (tmp_path / called).write_text(text)
                for read in (inspect, read_sound):
                    with pytest.raises(VideoError, match="cannot be opened as a video"):
                        read(VideoSource("cam1", tmp_path / called))
    assert watch.n_requests == 0


def test_playlists_that_come_through_a_pipe_open_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_clip(tmp_path / "other.mp4", numbered(3), codec="libx264", pix_fmt="yuv420p")
    with canary() as watch:
        for k, text in enumerate(playlists(watch.port).values()):
            os.mkfifo(tmp_path / f"pipe{k}")
            sender = Thread(target=(tmp_path / f"pipe{k}").write_text, args=(text,))
            sender.start()
            with (
                pytest.raises(VideoError, match="no images come from"),
                connect([VideoSource("c", tmp_path / f"pipe{k}")]),
            ):
                pass
            sender.join()
    assert watch.n_requests == 0


def test_no_hostile_name_reaches_an_address_or_takes_long(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo(tmp_path / "pipe.fifo")
    with canary() as watch:
        for name in hostile_names(watch.port):
            if len(name) < 256 and "\0" not in name:
                with pytest.raises(VideoError):
                    inspect(VideoSource("cam1", tmp_path / name))
    assert watch.n_requests == 0


def test_a_camera_on_the_network_is_for_live_input_only():
    with canary() as watch:
        with pytest.raises(VideoError, match="is an address; give a file, or read cameras on the network with --live"):
            inspect(VideoSource("cam1", f"rtsp://127.0.0.1:{watch.port}/left"))
        assert watch.n_requests == 0
        with (
            pytest.raises(VideoError, match="no images come from rtsp"),
            open_source(VideoSource("cam1", f"rtsp://127.0.0.1:{watch.port}/left"), Event()),
        ):
            pass
        assert watch.n_requests == 1


def test_a_camera_on_the_network_that_says_nothing_is_given_up(monkeypatch):
    monkeypatch.setattr("airborne.video.containers._SILENCE_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        source = VideoSource("cam1", f"rtsp://127.0.0.1:{silent.getsockname()[1]}/left")
        with pytest.raises(VideoError, match="it says nothing"), connect([source]):
            pass
