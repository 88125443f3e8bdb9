"""Mutates the inputs of every reader, and says which of them raises, hangs or takes much memory.

    python tests/fuzz/fuzz.py                        two minutes, seed 1
    python tests/fuzz/fuzz.py --seconds 3600 --seed 7
    python tests/fuzz/fuzz.py --only journal,net

The inputs are those of `readers.py` and of `tests/fuzz/corpus/READER/`, in which each fault that was
found stays. The same seed and number of rounds do the same. An input that shows a fault is written
to out/fuzz; put it into the corpus with its correction.
"""

from __future__ import annotations

import argparse
import hashlib
import logging
import os
import random
import re
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]
from readers import ROOT, Reader, readers  # noqa: E402

CORPUS = Path(__file__).parent / "corpus"
OUT = ROOT / "out" / "fuzz"
LIMIT_S = 10  # for one input
MEMORY = 3_000_000_000  # address space [bytes]
LONGEST = 200_000  # of an input [bytes]
ODD = [
    *(b"", b"\x00", b"\xff\xfe", b"\xed\xa0\x80", b"\x1b]0;x\x07", "\u202e".encode(), b"-1", b"0", b"1e999", b"NaN"),
    *(b"9" * 400, b"18446744073709551616", b"[" * 300, b"{" * 300, b"(" * 300, b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f"),
    *(b"null", b"true", b'""', b"[]", b"{}", b"<<: *a", b"&a [*a]", b"!!python/object:os.system x", b"\r\n", b"\t"),
    *(b"../../../etc/passwd", b"/dev/zero", b"a" * 5000, b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&amp;", b"%", b"$"),
]  # fmt: skip


class TooSlowError(BaseException):
    """An input takes longer than `LIMIT_S`; no reader catches it."""


def mutated(dice: random.Random, seeds: list[bytes]) -> bytes:
    """One of the inputs with some changes."""
    data = bytearray(dice.choice(seeds))
    for _ in range(dice.choice([1, 1, 1, 2, 3, 5, 10])):
        at = dice.randrange(len(data) + 1)
        end = min(len(data), at + dice.choice([1, 1, 2, 4, 8, 30, 200]))
        match dice.randrange(9):
            case 0 if data:
                data[min(at, len(data) - 1)] ^= 1 << dice.randrange(8)
            case 1:
                data[at:end] = dice.randbytes(end - at)
            case 2:
                del data[at:end]
            case 3:
                data[at:at] = dice.choice(ODD)
            case 4:
                data[at:end] = dice.choice(ODD)
            case 5:
                data[at:at] = data[at:end] * dice.choice([1, 2, 10, 100])
            case 6:  # a number becomes another one
                numbers = list(re.finditer(rb"-?\d+(?:\.\d+)?", data[:LONGEST]))
                if numbers:
                    one = dice.choice(numbers)
                    data[one.start() : one.end()] = dice.choice(
                        [b"-1", b"0", b"1e308", b"9" * 30, b'"x"', b"null"]
                    )
            case 7:  # a part of another input
                other = dice.choice(seeds)
                begin = dice.randrange(len(other) + 1)
                data[at:end] = other[begin : begin + dice.choice([4, 30, 300])]
            case 8:  # lines, or words, in another order
                by = dice.choice([b"\n", b" ", b","])
                parts = bytes(data).split(by)
                dice.shuffle(parts)
                data[:] = by.join(parts)
    return bytes(data[:LONGEST])


def fault_of(reader: Reader, data: bytes) -> str:
    """The fault that an input shows, or ""."""

    def too_slow(*_: object) -> None:
        raise TooSlowError

    signal.signal(signal.SIGALRM, too_slow)
    signal.alarm(LIMIT_S)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # they print texts of others
            reader.read(data)
    except reader.errors as error:
        if len(str(error)) > 100_000:
            return f"its error has {len(str(error))} characters"
    except TooSlowError:
        return f"it takes more than {LIMIT_S} s"
    except (Exception, RecursionError, MemoryError) as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error!s:.200} ({where.filename}:{where.lineno})"
    finally:
        signal.alarm(0)
    return ""


def kept_fault(name: str, data: bytes) -> Path:
    """Write an input that shows a fault."""
    folder = OUT / name.replace(" ", "_")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / hashlib.sha256(data).hexdigest()[:16]
    path.write_bytes(data)
    return path


def seeds_of(name: str, reader: Reader) -> list[bytes]:
    """The inputs to begin with."""
    folder = CORPUS / name.replace(" ", "_")
    return [*reader.seeds, *(path.read_bytes() for path in sorted(folder.glob("*")))]


def fuzz(name: str, reader: Reader, dice: random.Random, *, seconds: float, rounds: int) -> int:
    """Fuzz one reader for a time or a number of rounds; return the number of kinds of faults."""
    seeds = seeds_of(name, reader)
    found: dict[str, Path] = {}
    done, end = 0, time.monotonic() + seconds
    inputs = list(seeds)
    while (done < rounds) if rounds else (time.monotonic() < end or inputs):
        data = inputs.pop() if inputs else mutated(dice, seeds)
        fault = fault_of(reader, data)
        done += 1
        kind = fault.rpartition("(")[2] or fault
        if fault and kind not in found:
            found[kind] = kept_fault(name, data)
            print(f"{name}: {fault}\n    {found[kind]}", flush=True)
    print(f"{name}: {done} inputs, {len(found)} kinds of faults", flush=True)
    return len(found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=120.0, help="for all readers together")
    parser.add_argument("--rounds", type=int, default=0, help="for each reader, instead")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of readers, with commas")
    args = parser.parse_args()
    logging.disable(logging.CRITICAL)
    OUT.mkdir(parents=True, exist_ok=True)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    known = readers()
    chosen = args.only.split(",") if args.only else list(known)
    faults = 0
    for name in chosen:
        dice = random.Random(f"{args.seed} {name}")
        share = args.seconds / len(chosen)
        faults += fuzz(name, known[name], dice, seconds=share, rounds=args.rounds)
    sys.stdout.flush()
    # Not `sys.exit`: a reader may have left threads behind, which this must not wait for.
    os._exit(1 if faults else 0)


if __name__ == "__main__":
    main()
