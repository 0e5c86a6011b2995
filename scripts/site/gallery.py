"""Runs all shipped scenarios for the gallery: python scripts/site/gallery.py FOLDER

FOLDER/NAME gets the figures, a replay for the page, and what the run and its certificate say.
A folder that is there already is left as it is.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path


def show(name: str, folder: Path) -> None:
    """One scenario."""
    import gne_mj as gm
    from gne_mj.files import written
    from gne_mj.viewer import write_html

    with written("folder", folder / name, replace=False) as new:
        new.mkdir()
        run = gm.run(name)
        run.plot(new)
        (new / "run.txt").write_text(f"{run}\n", encoding="utf-8")
        certified = "\n".join(str(gm.certify(run, system=each)) for each in run.systems)
        (new / "certificate.txt").write_text(f"{certified}\n", encoding="utf-8")
        write_html(run, new / "replay.html", name)


def main(folder: Path) -> None:
    """All that are not there yet, two at a time."""
    from gne_mj.scenario import shipped

    folder.mkdir(parents=True, exist_ok=True)
    missing = [name for name in shipped() if not (folder / name).exists()]
    os.environ.update(MUJOCO_GL="disabled", MPLBACKEND="agg")
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(show, missing, [folder] * len(missing)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
