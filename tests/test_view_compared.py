"""Several runs on one clock: what is drawn where, what is laid over each other, what is told."""

import numpy as np
import pytest
from browser import Recorded
from test_view_browser import CLOSE, opened, origins, position, quiet, seek, until
from typer.testing import CliRunner

import gne_mj
from gne_mj.cli import app
from gne_mj.errors import InvalidInput
from gne_mj.viewer import html_page, replay_pack, serve
from gne_mj.viewer.differences import differences, headings, unique
from gne_mj.viewer.pack import unpack

FEWER = {"simulation.duration": 1.0, "agents.count": 3, "initial.action": [1.0, 0.0, -1.0]}
WIDTHS = ((390, 844), (720, 450), (1440, 900), (1920, 1080))


@pytest.fixture(scope="module")
def runs():
    """Two of robots in a lane, of which one is shorter, and one of channels without bodies."""
    return {
        "first": gne_mj.run("velocity-sync", {"simulation.duration": 2.0}),
        "second": gne_mj.run("velocity-sync", {"simulation.duration": 1.0, "barrier.rho": 0.5}),
        "channels": gne_mj.run("osnr", {"simulation.duration": 1.0}),
    }


@pytest.fixture(scope="module")
def planar():
    short = {"simulation.duration": 1.0, "plant.engine": "ode"}
    return [gne_mj.run("planar-sync", short), gne_mj.run("formation", {"simulation.duration": 0.5})]


def test_headings_are_what_differs_or_names():
    one = {"controller": {"gain": 1.0}, "initial": {"gain": 2.0}, "description": "one"}
    two = {"controller": {"gain": 3.0}, "initial": {"gain": 2.0}, "description": "two"}
    three = {"controller": {"gain": 3.0}, "initial": {"gain": 4.0}}
    assert headings(["a", "b"], [one, two]) == ["gain = 1.0", "gain = 3.0"]
    assert headings(["a", "b"], [one, three]) == [
        "controller.gain = 1.0, initial.gain = 2.0",
        "controller.gain = 3.0, initial.gain = 4.0",
    ]
    assert headings(["a", "b"], [one, one]) == ["a", "b"]
    assert differences([one, one])[0] == "no key differs"
    many = [{f"key-{k}": k + run for k in range(20)} for run in range(2)]
    assert headings(["a", "b"], many) == ["a", "b"]
    assert differences(many)[0].endswith("and 8 keys more")
    longer = {"simulation": {"duration": 3.0}}
    assert headings(["a", "b"], [longer, {}]) == ["a", "b"]  # the run itself says how long it is
    assert unique(["a", "b", "a"]) == ["a", "b", "a (2)"]


def test_runs_are_on_one_clock_and_keep_their_numbers(runs):
    """At their own samples the numbers of each run's own dataset; after its end none."""
    meta, arrays = unpack(replay_pack(runs))
    time = arrays["time"]
    assert time[0] == 0.0
    assert time[-1] == 2.0
    assert meta["duration"] == 2.0
    assert [run["name"] for run in meta["runs"]] == list(runs)
    assert [run["end"] for run in meta["runs"]] == [2.0, 1.0, 1.0]
    assert [system["run"] for system in meta["systems"]] == [0, 1, 2]
    for name, run in runs.items():
        data = run.data
        own = arrays[f"{name}/action"]
        at = np.searchsorted(time, data["time"].to_numpy() - 1e-9)
        assert np.allclose(own[at], data["action"].to_numpy(), rtol=1e-6)
        assert np.all(np.isnan(own[time > data["time"].to_numpy()[-1] + 1e-9]))
    assert meta["outcome"]["second"]["status"] == runs["second"].reports["robots"]["status"]


def test_samples_of_several_clocks_are_merged():
    """The union of both clocks' multiples, each once."""
    clocks = {"recording.period": 0.02, "simulation.duration": 0.4}
    other = {"recording.period": 0.05, "simulation.duration": 0.4}
    pair = [gne_mj.run("velocity-sync", each) for each in (clocks, other)]
    time = unpack(replay_pack(pair))[1]["time"]
    expected = sorted(
        {round(0.02 * k, 9) for k in range(21)} | {round(0.05 * k, 9) for k in range(9)}
    )
    assert np.allclose(time, expected)


def test_fleets_in_the_plane_are_beside_each_other_at_all_times(planar):
    meta, arrays = unpack(replay_pack(planar))
    poses = np.tile(arrays["pose_base"], (len(arrays["time"]), 1))
    poses[:, arrays["pose_columns"]] = arrays["pose_values"]
    x = poses.reshape(len(poses), -1, 8)[..., 0]
    ends = []
    for system in meta["systems"]:
        first, count = system["items"]
        ends.append(x[:, first : first + count] + system["beside"][0])
        assert system["shift"] == [0.0, 0.0]
        assert system["beside"][1] == 0.0
    both = arrays["time"] <= 0.5
    assert np.all(ends[1][both].min(axis=1) - ends[0][both].max(axis=1) > 1.0)


def test_systems_of_one_run_in_the_plane_are_beside_each_other(tmp_path):
    (tmp_path / "two.toml").write_text(
        "[simulation]\nduration = 0.2\n"
        + "".join(
            f'[systems.{name}.game]\ntype = "velocity-consensus"\nreference_velocity = [1.0, 0.5]\n'
            "edges = [[1, 2]]\nleader_weight = [1.0, 0.0]\ngap_bound = 2.0\n"
            f'[systems.{name}.agents]\ntype = "planar-flexible-robot"\ncount = 2\n'
            f"[systems.{name}.initial]\naction = [[1.0, 0.5], [1.0, 0.5]]\n"
            "position = [[0.0, 0.0], [2.0, 0.0]]\n"
            for name in ("one", "two")
        )
    )
    meta, arrays = unpack(replay_pack(gne_mj.run(tmp_path / "two.toml")))
    one, two = (system["items"] for system in meta["systems"])
    x = arrays["pose_base"].reshape(-1, 8)[:, 0]
    assert x[two[0] : sum(two)].min() - x[one[0] : sum(one)].max() > 1.0


def test_too_many_runs_and_indices_are_refused(runs, tmp_path):
    with pytest.raises(InvalidInput, match="from 1 to 4"):
        html_page([runs["first"]] * 5)
    runs["first"].save(tmp_path / "a.zarr")
    result = CliRunner().invoke(app, ["view", *[str(tmp_path / "a.zarr")] * 5])
    assert isinstance(result.exception, InvalidInput)
    assert "at most 4" in str(result.exception)
    result = CliRunner().invoke(app, ["view", *[str(tmp_path / "a.zarr")] * 2, "--index", "1"])
    assert "one folder" in str(result.exception)


def test_the_command_writes_one_file_of_two_runs(runs, tmp_path):
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        runs[name].save(tmp_path / name / "trajectory.zarr")
    html = tmp_path / "both.html"
    result = CliRunner().invoke(
        app, ["view", str(tmp_path / "first"), str(tmp_path / "second"), "--html", str(html)]
    )
    assert result.exit_code == 0
    text = html.read_text()
    assert "first · second" in text
    assert text.count('id="replay"') == 1


def drawn(page):
    return {system["name"]: system for system in page.evaluate("window.gne.compared()")}


def test_two_runs_in_a_browser(page, recorded, runs):
    """What three.js shows at a time is where the runs' datasets have the robots."""
    server = serve({name: runs[name] for name in ("first", "second")}, "both")
    try:
        opened(page, server.url)
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            until(page, "window.gne.plots[0].width > 200")
            assert page.locator("#run-keys button").count() == 2
            assert page.locator("#compare").is_visible()
            page.locator("#keep summary").click()
            box = page.locator("#keep-video").bounding_box()
            assert 0 <= box["x"] <= box["x"] + box["width"] <= width
            page.locator("#keep summary").click()
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        names = ["rho = 0.1", "rho = 0.5"]
        plots = page.evaluate("window.gne.plots")
        assert plots[0]["series"] == [*"12345", *"12345"]
        assert plots[0]["dashes"] == [*[[]] * 5, *[[7, 3]] * 5]
        assert len(set(plots[0]["colours"])) == 5
        assert plots[0]["colours"][:5] == plots[0]["colours"][5:]
        for time in (0.5, 1.5):
            seek(page, time)
            for name, run, own in zip(names, runs.values(), ("first", "second"), strict=False):
                x = run.data["position"].sel(time=min(time, run.data["time"][-1]), method="nearest")
                found = position(page, f"meshcat/{name}/robot_2/main")
                assert np.allclose(found, [x[1], 0.0 if own == "first" else -1.2, 0], atol=CLOSE)
        page.keyboard.press("b")
        until(page, "window.gne.compared()[1].opacity < 0.5")
        assert position(page, "meshcat/rho = 0.5/robot_2/main")[1] == pytest.approx(0.0)
        assert [each["opacity"] < 0.5 for each in drawn(page).values()] == [False, True]
        assert "translucent, in rings: rho = 0.5" in page.locator("#compare-note").inner_text()
        page.locator("#run-keys button").nth(0).click()  # the first is switched off
        until(page, "window.gne.compared().map(each => each.visible).join() === 'false,true'")
        assert page.evaluate("window.gne.plots[0].shown") == [*[False] * 5, *[True] * 5]
        assert [each["opacity"] < 0.5 for each in drawn(page).values()] == [False, False]
        quiet(recorded, *origins(server))
    finally:
        server.close()


@pytest.mark.slow
def test_only_what_runs_have_in_common_is_plotted_and_the_rest_is_told(browser, runs, planar):
    fewer = gne_mj.run("velocity-sync", FEWER)
    first = ["action", "gap", "constraint"]
    cases = [
        ((runs["first"], fewer), first, "velocity of robot 4, 5 (count = 5)"),
        ((runs["channels"], planar[1]), ["lyapunov"], "total power (run 1)"),
    ]
    for pair, names, told in cases:
        server = serve(list(pair))
        recorded = Recorded()
        try:
            with browser.page(recorded) as page:
                opened(page, server.url)
                page.keyboard.press("b")
                seek(page, 0.4)
                found = [plot["name"] for plot in page.evaluate("window.gne.plots")]
                assert set(names) <= set(found)
                assert told in page.locator("#plots-left").inner_text()
            quiet(recorded, *origins(server))
        finally:
            server.close()
