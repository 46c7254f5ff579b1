"""Commands about this machine: its speed, and its kernels compiled ahead."""

from __future__ import annotations

import json
import time

from airborne.cli.console import Json


def bench_command(as_json: Json = False) -> None:
    """Measure the speed of this machine on the bundled example: CPU time per field, and per hypothesis.

    Example: airborne bench
    """
    from airborne.run.bench import measure_speed

    speeds = measure_speed()
    print(json.dumps(speeds) if as_json else "\n".join(f"{name}: {value:.3g}" for name, value in speeds.items()))


def warm_command() -> None:
    """Compile now what the first runs would compile, for machines that are prepared; a minute or more, once.

    Example: airborne warm
    """
    from airborne.run.warm import warm_kernels

    begun_s = time.monotonic()
    warm_kernels()
    print(f"kernels are ready after {time.monotonic() - begun_s:.0f} s")
