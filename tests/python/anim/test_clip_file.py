# SPDX-License-Identifier: MIT
"""Tests clips in .rzc files: lossless round trips, parts, recordings, and refusals."""

import os
import threading

import numpy as np
import pytest
from risorius import Clip, ClipError, ClipReader, ClipWriter, Event


def make_clip(frames=1300, times=True):
    """A clip of random bits with NaN, -0 and denormals. Two curves are constant, two are equal."""
    rng = np.random.default_rng(1)
    bits = rng.integers(0, 2**32, (7, frames), np.uint64).astype(np.uint32)
    bits[3] = 0x7FC12345
    bits[4] = bits[0]
    bits[5] = 0x80000000
    bits[6] = np.arange(frames) % 3
    return Clip(
        [f"c{i}" for i in range(7)],
        bits.view(np.float32),
        29.97,
        start=2.0,
        times=np.cumsum(rng.random(frames) + 0.01) if times else None,
        events=[Event(30.0, "word", 0.5, "hé"), Event(4.0, "flash")],
        metadata={"take": "3", "actor": "é\udcff"},
    )


def assert_same(a, b):
    assert a.names == b.names
    assert a.curves.tobytes() == b.curves.tobytes()
    assert (a.rate, a.start, a.events, a.metadata) == (b.rate, b.start, b.events, b.metadata)
    assert (a.times is None) == (b.times is None)
    if a.times is not None:
        assert a.times.tobytes() == b.times.tobytes()


@pytest.mark.parametrize("times", [True, False])
@pytest.mark.parametrize("frames", [0, 1, 512, 1300])
def test_a_saved_clip_is_loaded_as_it_was(tmp_path, frames, times):
    clip = make_clip(frames, times)
    clip.save(tmp_path / "é.rzc")
    assert_same(Clip.load(tmp_path / "é.rzc"), clip)
    assert_same(Clip.load((tmp_path / "é.rzc").read_bytes()), clip)
    assert_same(Clip.load(clip.to_bytes()), clip)
    assert os.listdir(tmp_path) == ["é.rzc"]


def test_random_bits_grow_by_less_than_a_percent():
    bits = np.random.default_rng(2).integers(0, 2**32, (260, 600), np.uint64).astype(np.uint32)
    clip = Clip([f"c{i}" for i in range(260)], bits.view(np.float32))
    assert len(clip.to_bytes()) < 1.01 * bits.nbytes


def test_frames_and_controls_of_a_file():
    clip = make_clip()
    data = clip.to_bytes()
    part = Clip.load(data, frames=(500, 600), controls=["c6", "c1"])
    assert part.names == ("c6", "c1")
    assert part.curves.tobytes() == clip.curves[[6, 1], 500:600].tobytes()
    assert part.times.tobytes() == clip.times[500:600].tobytes()
    reader = ClipReader(data)
    assert reader.names == clip.names
    assert reader.frame_count == 1300
    assert reader.block_starts == [0, 512, 1024, 1300]
    assert reader.events == clip.events
    assert reader.read((7, 7)).frame_count == 0
    with pytest.raises(KeyError):
        reader.read(controls=["none"])
    for frames in ((-1, 3), (3, 2), (0, 1301)):
        with pytest.raises(ClipError, match="frames from 0 to 1300 were expected"):
            reader.read(frames)


def test_a_part_starts_when_its_first_frame_does_and_has_the_events_of_its_time():
    clip = make_clip(times=False)
    reader = ClipReader(clip.to_bytes())
    part = reader.read((45, 100))
    np.testing.assert_allclose(part.frame_times(), clip.frame_times()[45:100], rtol=1e-15)
    assert [event.name for event in part.events] == ["flash"]  # frames 45 to 99: 3.5 s to 5.3 s
    assert reader.read((0, 45)).events == ()


def test_a_recording_is_the_clip(tmp_path):
    clip = make_clip()
    with ClipWriter(
        tmp_path / "take.rzc", clip.names, clip.rate, has_times=True, metadata=clip.metadata
    ) as take:
        take.append(clip.curves[:, 0], clip.times[0])
        take.append(clip.curves[:, 1:700].T, clip.times[1:700])
        take.event(clip.events[0])
        take.append(clip.curves[:, 700:].T, clip.times[700:])
        take.event(clip.events[1])
        assert take.frame_count == 1300
        assert not (tmp_path / "take.rzc").exists()
        # Frames that have been recorded can be read while the recording continues.
        part = ClipReader(take.part, recover=True)
        assert part.frame_count == 1024
        assert part.read().curves.tobytes() == clip.curves[:, :1024].tobytes()
        assert part.events == (clip.events[0],)
    assert os.listdir(tmp_path) == ["take.rzc"]
    assert_same(Clip.load(tmp_path / "take.rzc"), clip.replaced(start=clip.times[0]))
    with pytest.raises(ClipError, match="has been closed"):
        take.append(clip.curves[:, :1].T, [1e6])
    take.close()


def test_a_recording_that_ends_badly_stays_and_is_not_written_over(tmp_path):
    path = tmp_path / "take.rzc"

    def record(value):
        with ClipWriter(path, ["a"], block_frames=10) as take:
            parts.append(take.part)
            take.append(np.full((25, 1), value))
            raise RuntimeError

    parts = []
    for value in (1.0, 2.0):
        with pytest.raises(RuntimeError):
            record(value)
        assert not path.exists()
        left = ClipReader(parts[-1], recover=True)
        assert left.frame_count == 20
        assert (left.read().curves == value).all()
        with pytest.raises(ClipError, match="no index at its end") as caught:
            ClipReader(parts[-1])
        assert caught.value.where == "index"
        assert caught.value.code == "truncated"
    assert len(os.listdir(tmp_path)) == 2


def test_what_a_recording_refuses(tmp_path):
    with pytest.raises(ClipError, match="names\\[1\\]"):
        ClipWriter(tmp_path / "a.rzc", ["x", "x"])
    with pytest.raises(ClipError, match="rate above 0"):
        ClipWriter(tmp_path / "a.rzc", ["x"], 0)
    with pytest.raises(ClipError, match=r"a\.rzc: its folder is not there"):
        ClipWriter(tmp_path / "none" / "a.rzc", ["x"])
    take = ClipWriter(tmp_path / "a.rzc", ["x", "y"], has_times=True)
    with pytest.raises(ValueError, match=r"\(n, 2\)"):
        take.append([[1.0, 2.0, 3.0]], [0.0])
    with pytest.raises(ClipError, match="as many times as frames"):
        take.append([[1.0, 2.0]])
    take.append([[1.0, 2.0]], [1.0])
    with pytest.raises(ClipError, match="a time after 1") as caught:
        take.append([[1.0, 2.0]], [1.0])
    assert caught.value.where == "times[1]"


def test_files_that_are_no_clips_are_refused(tmp_path):
    path = tmp_path / "a.rzc"
    with pytest.raises(ClipError, match=r"a\.rzc.*No such file"):
        Clip.load(path)
    path.write_bytes(b"PNG")
    with pytest.raises(ClipError, match=r"a\.rzc: this is no clip") as caught:
        Clip.load(path)
    assert (caught.value.code, caught.value.offset) == ("not_clip", 0)
    data = bytearray(make_clip().to_bytes())
    data[2000] ^= 1
    with pytest.raises(ClipError, match="checksum is another") as caught:
        Clip.load(bytes(data))
    assert caught.value.where == "blocks[0]"
    assert caught.value.offset > 0
    assert isinstance(caught.value, ValueError)


def test_a_reader_serves_threads():
    clip = make_clip(4000)
    reader = ClipReader(clip.to_bytes())
    wrong = []

    def read(seed):
        rng = np.random.default_rng(seed)
        for _ in range(40):
            begin, end = np.sort(rng.integers(0, 4001, 2)).tolist()
            if reader.read((begin, end)).curves.tobytes() != clip.curves[:, begin:end].tobytes():
                wrong.append((begin, end))

    threads = [threading.Thread(target=read, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_after_a_write_that_failed_nothing_more_is_written(tmp_path):
    resource = pytest.importorskip("resource")
    path = tmp_path / "take.rzc"
    Clip(["a"], [[1.0, 2.0]]).save(path)
    before = path.read_bytes()
    noise = np.random.default_rng(1).normal(size=(64, 1)).astype(np.float32)
    writer = ClipWriter(path, ["a"], 60.0, block_frames=16)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with pytest.raises(ClipError, match="cannot write"):
            writer.append(noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    for go_on in (lambda: writer.append(noise), writer.close, writer.close):
        with pytest.raises(ClipError, match="cannot write"):
            go_on()
    assert path.read_bytes() == before


def test_a_name_that_cannot_be_taken_is_said_each_time(tmp_path):
    path = tmp_path / "take.rzc"
    writer = ClipWriter(path, ["a"], 60.0)
    writer.append(np.ones((3, 1), np.float32))
    path.mkdir()  # the folder appears while recording; an existing folder would be refused at once
    with pytest.raises(ClipError, match="Is a directory"):
        ClipWriter(path, ["a"], 60.0)
    for _ in range(2):
        with pytest.raises(ClipError, match="cannot write"):
            writer.close()
    assert ClipReader(writer.part).frame_count == 3


def test_what_a_reader_would_refuse_is_not_written():
    for clip in (
        Clip(["a"], [[1.0]], metadata={"x": "y" * (1 << 24)}),
        Clip([str(i) for i in range(65537)], np.zeros((65537, 1))),
    ):
        with pytest.raises(ClipError, match="limit is|were expected"):
            clip.to_bytes()
