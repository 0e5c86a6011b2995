"""The command that compiles ahead."""

from typing import Annotated

import typer

from gne_mj.cli.application import app
from gne_mj.progress import telling


@app.command()
def precompile(
    processes: Annotated[
        int | None,
        typer.Option("--processes", min=1, help="Beside each other; as many as processors else."),
    ] = None,
) -> None:
    """Compile all loops, solvers, shipped games and laws now, rather than each when first needed.

    Takes half a minute on two processors; machine code is kept, so that once is enough.
    """
    from gne_mj import precompile as compiling

    total = len(compiling.runs()) + len(compiling.batches())
    with telling("compiling") as tell:
        for done, name in enumerate(compiling.precompile(processes), start=1):
            tell(done, total, f"compiled {done} of {total}: {name}")
    print(f"compiled what {total} kinds of runs need")
