"""The arena's page: tables and figures from the results, nothing of them by hand."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cases
import numpy as np

if TYPE_CHECKING:
    import xarray

DOCS = Path(__file__).parents[2] / "docs"
KEPT = DOCS / "arena" / f"results-{cases.VERSION}.json"
PAGE = DOCS / "arena.md"
BEGIN, END = "<!-- arena: made by scripts/arena --page -->", "<!-- arena: end -->"
OURS = ("full", "partial", "distributed")
FIGURE = ("desired", "ideal")  # whose violation over time the README shows
CURVE = "violation.json"  # of a case: the greatest violation of each law's runs over time
SETTLING, ERROR = "settling (s), median", "final error, median"
OVERVIEW = (
    "cases",
    "inside",
    "of inside",
    "certified",
    "of certified",
    "first",
    "nearest",
)  # counted in all cases
# Columns of the page's tables, of those that comparisons have
COLUMNS = {
    "mode": "mode", "certified": "certified", "inside": "inside", "to the end": "to the end",
    "violation, worst": "violation, worst",
    "of the bound, worst": "of the bound", "outside (s), median": "outside (s)",
    "settling (s), median": "settling (s)", "final error, median": "final error",
    "epsilon, median": "epsilon", "RMS input, median": "RMS input", "messages": "messages",
    "step (us)": "step (us)",
}  # fmt: skip


def keep_curves(data: "xarray.Dataset", folder: Path) -> None:
    """Keep what the figure draws of a case."""
    found: dict[str, Any] = {"time": data["time"].to_numpy().round(6).tolist(), "laws": {}}
    for law in data["law"].to_numpy():
        values = data["violation"].sel(law=law).to_numpy()
        gone = np.all(np.isnan(values), axis=0)
        worst = np.max(np.where(np.isnan(values), 0.0, values), axis=0)
        found["laws"][str(law)] = {
            "worst": [None if nobody else float(v) for nobody, v in zip(gone, worst, strict=True)]
        }
    (folder / CURVE).write_text(json.dumps(found), encoding="utf-8")


def collect(folder: Path) -> dict[str, Any]:
    """All cases that are there, with what decides them."""
    found: dict[str, Any] = {"version": cases.VERSION, "seed": cases.SEED, "cases": {}}
    for condition in cases.CONDITIONS:
        for problem in cases.PROBLEMS:
            path = folder / problem / condition / "comparison.json"
            if path.exists():
                case = json.loads(path.read_text(encoding="utf-8"))
                case.pop("scenario")
                found["cases"][f"{problem}/{condition}"] = case
    return found


def tables(results: dict[str, Any]) -> str:
    """The tables, as Markdown."""
    lines = ["### All cases together", "", *_overview(results), ""]
    for condition, what in cases.CONDITIONS.items():
        lines += [f"### {condition.capitalize()}", "", str(what.__doc__).strip(), ""]
        for name, problem in cases.PROBLEMS.items():
            case = results["cases"].get(f"{name}/{condition}")
            if case is None:
                lines += [f"**{problem.title}**: not run.", ""]
                continue
            lines += [f"**{problem.title}**", "", *_table(case), ""]
    return "\n".join(lines)


def _overview(results: dict[str, Any]) -> list[str]:
    """A row for each law: of all its runs how many stayed inside, in all cases and where certified;
    how far it went; and in how many cases none settled sooner, or ended nearer."""
    found: dict[str, dict[str, Any]] = {}
    for case in results["cases"].values():
        least = {key: _least(case, key) for key in (SETTLING, ERROR)}
        for law in case["laws"]:
            own = found.setdefault(law["law"], dict.fromkeys(OVERVIEW, 0) | {"worst": 0.0})
            own["cases"] += 1
            certified = law["certified"].startswith("certified") and "small" not in law["certified"]
            for key, counts in (("inside", True), ("certified", certified)):
                own[key] += law["inside"] * counts
                own[f"of {key}"] += law["runs"] * counts
            own["worst"] = max(own["worst"], law["of the bound, worst"] or 0.0)
            own["first"] += law[SETTLING] is not None and law[SETTLING] <= least[SETTLING]
            own["nearest"] += law[ERROR] is not None and law[ERROR] <= least[ERROR]
    titles = [
        "law", "cases", "runs inside", "where certified", "largest violation, of the bound",
        "settled first", "ended nearest",
    ]  # fmt: skip
    rows = [titles, ["---"] * len(titles)]
    for name, own in sorted(found.items(), key=lambda each: not _is_ours(each[0])):
        certified = f"{own['certified']}/{own['of certified']}" if own["of certified"] else "-"
        rows.append([
            _name(name), str(own["cases"]), f"{own['inside']}/{own['of inside']}", certified,
            f"{100 * own['worst']:.3g}%", str(own["first"]), str(own["nearest"]),
        ])  # fmt: skip
    return [f"| {' | '.join(row)} |" for row in rows]


def _least(case: dict[str, Any], key: str) -> float:
    return min((law[key] for law in case["laws"] if law[key] is not None), default=np.inf)


def _name(law: str) -> str:
    return f"**{law}**" if _is_ours(law) else f"`{law}`"


def _table(case: dict[str, Any]) -> list[str]:
    titles = ["law", *COLUMNS.values()]
    rows = [titles, ["---"] * len(titles)]
    for law in sorted(case["laws"], key=lambda each: not _is_ours(each["law"])):
        cells = [_cell(key, law) for key in COLUMNS]
        rows.append([_name(law["law"]), *cells])
    found = [f"| {' | '.join(row)} |" for row in rows]
    if case["refused"]:
        found += ["", f"Not for it: {', '.join(case['refused'])}."]
    return found


def _is_ours(law: str) -> bool:
    return law.split("-")[0] in OURS


def _cell(key: str, law: dict[str, Any]) -> str:
    value = law[key]
    if key in ("inside", "to the end"):
        return f"{value}/{law['runs']}"
    if key.startswith(("settling", "final")) and value is None:
        return "not"
    if value is None:
        return "-"
    if key.startswith("of the bound"):
        return f"{100 * value:.3g}%"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def write(results: dict[str, Any], folder: Path) -> None:
    """Put the tables into the page, keep the results beside it, and draw the figure."""
    KEPT.parent.mkdir(exist_ok=True)
    KEPT.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    made = f"{before}{BEGIN}\n\n{tables(results)}\n{END}{after}"
    PAGE.write_text(made, encoding="utf-8")
    curves = folder.joinpath(*FIGURE, CURVE)
    if curves.exists():
        drawn = json.loads(curves.read_text(encoding="utf-8"))
        draw(drawn, results["cases"]["/".join(FIGURE)], DOCS / "figures" / "arena.png")


def draw(curves: dict[str, Any], case: dict[str, Any], file: Path) -> None:
    """The violation over time of laws that were outside, and below it the names of the others.

    Args:
        curves: of the case, as :func:`keep_curves` has them.
        case: its results.
        file: to write.
    """
    from gne_mj.plots.style import line_style, styled, subplots

    by_worst = sorted(case["laws"], key=lambda law: -(law["of the bound, worst"] or 0.0))
    left = [law for law in by_worst if law["inside"] < law["runs"]]
    never = sorted(
        (law["law"] for law in case["laws"] if law not in left), key=lambda law: not _is_ours(law)
    )
    time, least = np.array(curves["time"]), 1e-3  # below which heights are in proportion
    with styled():
        figure, grid = subplots(1, 1, 7.2, 3.4)
        axes = grid[0, 0]
        for number, law in enumerate(left):
            worst = np.array(curves["laws"][law["law"]]["worst"], dtype=float)
            label = f"{law['law']} ({_cell('of the bound, worst', law)})"
            axes.plot(time, worst, label=label, **line_style(number))
        axes.axhline(0.0, color="black", linewidth=2.6)
        axes.axhspan(-least, 0.0, color="green", alpha=0.12, linewidth=0)
        names = ", ".join(f"{law}*" if _is_ours(law) else law for law in never)
        words = f"never outside: {names}    (* this package's)"
        axes.text(0.5 * time[-1], -0.5 * least, words, ha="center", va="center", fontsize=8)
        axes.set_yscale("symlog", linthresh=least)
        axes.set(xlabel="time (s)", ylabel="how far outside the shared limits")
        axes.set(xlim=(0.0, time[-1]), ylim=(-least, None))
        axes.set_yticks([0.0, *(10.0**k for k in range(-3, 1))])
        axes.legend(
            loc="center left", bbox_to_anchor=(1.0, 0.5),
            title="outside, at most by\n(of the bound)", alignment="left",
        )  # fmt: skip
        figure.savefig(file, dpi=160)
