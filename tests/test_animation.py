"""The picture that plays by itself: of what it shows, and what it refuses."""

from itertools import pairwise

import numpy as np
import pytest
from commands import gne_here
from PIL import Image

import gne_mj
from gne_mj import plots
from gne_mj.errors import InvalidInput
from gne_mj.plots import animation
from gne_mj.plots.plane import outlines, pairs, plane, points


@pytest.fixture(scope="module")
def formation():
    return gne_mj.run("formation", {"simulation.duration": 1.0, "recording.period": 0.05})


def test_frames_follow_the_run_to_its_end(formation, tmp_path):
    told = []
    path = plots.animate(
        formation, tmp_path / "formation.webp", progress=lambda *each: told.append(each)
    )
    (name,) = formation.tree.children
    rows = formation[name].sizes["time"]
    with Image.open(path) as film:
        assert film.format == "WEBP"
        assert film.is_animated
        assert 2 <= film.n_frames <= min(animation.FRAMES, rows)
        frames = []
        for number in range(film.n_frames):
            film.seek(number)
            frames.append(np.asarray(film.convert("L"), float))
    assert [done for done, *_ in told] == list(range(1, len(frames) + 1))
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(frames))
    assert path.stat().st_size < 1.5e6


def test_what_is_in_the_plane_is_read_off_the_trajectory(formation):
    (name,) = formation.tree.children
    data = formation[name]
    place = points(data)
    np.testing.assert_array_equal(place[:, 1, 0], data["position"].values[:, 2])
    assert place.shape == (data.sizes["time"], data.sizes["agent"], 2)
    assert pairs(data)
    assert all(0 <= i < j < place.shape[1] for i, j in pairs(data))
    assert all(np.shape(corners)[1] == 2 for corners in outlines(data))


def test_others_are_refused_and_nothing_is_written(tmp_path):
    run = gne_mj.run("velocity-sync", {"plant.engine": "ode", "simulation.duration": 0.05})
    (name,) = run.tree.children
    assert points(run[name]) is None
    assert plane(run[name]) is None
    with pytest.raises(InvalidInput, match="no system of this run moves in the plane"):
        plots.animate(run, tmp_path / "lane.webp")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_command_replaces_only_when_asked(formation, tmp_path):
    folder, film = tmp_path / "run", tmp_path / "film.webp"
    folder.mkdir()
    formation.save(folder / "trajectory.zarr")
    film.write_bytes(b"mine")
    done = gne_here("plot", folder, "--animation", film)
    assert (done.returncode, film.read_bytes()) == (2, b"mine")
    assert done.stderr.startswith(f"gne-mj: --animation: got '{film}', but it exists already")
    done = gne_here("plot", folder, "--animation", film, "--replace")
    assert (done.returncode, done.stdout) == (0, f"{film}\n")
    with Image.open(film) as shown:
        assert shown.is_animated
