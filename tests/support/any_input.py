"""Feeds random and mutated files to every reader of the package, and those of `tests/corpus`, which broke one once.

`python -m tests.support.any_input [--files N] [--seconds S] [--seed K] [--reader NAME]`; test_any_input_file.py runs it
in a process of its own. With `--seconds` it goes on, seed after seed, until they are over. Prints one JSON object: how
many files each reader saw, what came out that was no AirborneError, the slowest file, the memory taken.
"""

import argparse
import json
import random
import resource
import signal
import tempfile
import time
import traceback
import warnings
from itertools import count
from pathlib import Path

from airborne.errors import AirborneError
from tests.support.any_input_readers import cases
from tests.support.mutations import MUTATORS

CORPUS = Path(__file__).resolve().parents[1] / "corpus"  # a folder a reader
CPU_LIMIT_S = 4.0
MEMORY_LIMIT_BYTES = 1_000_000_000  # above what the process takes with everything loaded
WEIGHTS = {
    **{"video": 0.4, "images of a video": 0.4, "sound": 0.5},
    **{"command line": 0.4, "mesh.ply": 0.5, "mesh.stl": 0.5, "run summary": 0.4},
}


class TooSlowError(Exception):
    """A file took too long."""


def too_slow(*_):
    raise TooSlowError(f"more than {CPU_LIMIT_S} s of CPU")


def fed(case, how, seed):
    """Give a reader a mutated file; return the CPU time and what came out that should not."""
    data = how(case.whole, random.Random(f"{case.name} {seed}"))
    case.path.write_bytes(data)
    before = time.process_time()
    try:
        wrong = complaint(case.read)
    except TooSlowError:  # in the very moment when all was done
        wrong = None
    signal.setitimer(signal.ITIMER_PROF, 0)
    cpu_s = time.process_time() - before
    case.path.write_bytes(case.whole)
    return cpu_s, wrong or (f"took {cpu_s:.1f} s" if cpu_s > CPU_LIMIT_S else None)


def complaint(read):
    """What came out of a reader that should not; None where nothing did."""
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT_S)
    try:
        read()
    except AirborneError as error:
        is_plain = "\n" not in str(error) and str(error).strip() and len(str(error)) < 2000
        return None if is_plain else f"not one plain line: {str(error)[:300]!r}"
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)
        ours = [f"{Path(frame.filename).name}:{frame.lineno}" for frame in where if "airborne" in frame.filename]
        return f"{type(error).__name__}: {str(error)[:200]} at {' '.join(ours[-3:])}"
    return None


def fuzz(case, n, seed):
    """Feed n files to one reader."""
    choice, failures, slowest = random.Random(f"{case.name} {seed}"), [], (0.0, "")
    for _ in range(n):
        how, number = choice.choice(MUTATORS), choice.getrandbits(32)
        cpu_s, wrong = fed(case, how, number)
        slowest = max(slowest, (cpu_s, f"{how.__name__} {number}"))
        if wrong:
            failures.append(f"{how.__name__} {number}: {wrong}")
    return failures, slowest


def fed_corpus(case):
    """Feed a reader the files that broke it once; return what came out that should not."""
    failures = []
    for path in sorted((CORPUS / case.name).glob("*")):
        case.path.write_bytes(path.read_bytes())
        wrong = complaint(case.read)
        signal.setitimer(signal.ITIMER_PROF, 0)
        failures += [f"{path.name}: {wrong}"] if wrong else []
    case.path.write_bytes(case.whole)
    return failures


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", default="")
    options = parser.parse_args()
    warnings.simplefilter("error")
    signal.signal(signal.SIGPROF, too_slow)
    found = {"files": {}, "failures": {}, "slowest": {}, "seed": options.seed}
    with tempfile.TemporaryDirectory() as name:
        chosen = [each for each in cases(Path(name)) if options.reader in each.name]
        for each in chosen:
            each.read()  # all that is loaded once is loaded now; and the file as it is is read without complaint
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY_LIMIT_BYTES,) * 2)
        total = sum(WEIGHTS.get(each.name, 1.0) for each in chosen)
        start, end_s = time.process_time(), time.monotonic() + options.seconds
        for each in chosen:
            failures = fed_corpus(each)
            if failures:
                found["failures"][each.name] = failures
        for seed in count(options.seed):
            for each in chosen:
                n = -int(-options.files * WEIGHTS.get(each.name, 1.0) // total)
                failures, slowest = fuzz(each, n, seed)
                found["files"][each.name] = found["files"].get(each.name, 0) + n
                found["slowest"][each.name] = max(found["slowest"].get(each.name, (0.0, "")), slowest)
                if failures:
                    found["failures"].setdefault(each.name, []).extend(f"seed {seed}: {text}" for text in failures)
            if time.monotonic() >= end_s:
                break
        found["cpu_s"] = round(time.process_time() - start, 1)
    found["grown_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024 - before_mb
    print(json.dumps(found))


if __name__ == "__main__":
    main()
