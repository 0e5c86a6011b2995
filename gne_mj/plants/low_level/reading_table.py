"""What a user's controller reads: as outputs are declared, or places and orientations."""

from typing import Literal

from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.plants.low_level.table import Seen, orientation
from gne_mj.plants.mjcf_output import FRAMES, OutputTable


class ReadingTable(OutputTable):
    """A velocity, a position or an orientation of a part of the robot."""

    value: Literal["velocity", "position", "orientation"] = Field(
        "velocity", description="which; an orientation is nine numbers, its matrix row by row"
    )

    def seen(self) -> tuple[Seen, ...]:
        """One for each number.

        Raises:
            InvalidInput: it names nothing or several things, or has no orientation.
        """
        channels = self.channels(3)
        if self.value != "orientation":
            return tuple(Seen(of, self.value) for of in channels)
        kind, name = channels[0].kind, channels[0].name
        if kind not in FRAMES:
            raise InvalidInput(
                "input.readings", name, f"only a {', '.join(FRAMES)} has an orientation"
            )
        return orientation(kind, name)
