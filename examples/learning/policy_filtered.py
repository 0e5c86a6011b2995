"""The same policy under the barrier: what it asks for is a pull, and what acts stays inside."""

import runpy
from pathlib import Path

action = runpy.run_path(str(Path(__file__).with_name("policy.py")))["action"]
FILTERED = True
