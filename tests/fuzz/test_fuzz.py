"""Every reader takes or refuses its corpus, and some mutations of it; `make fuzz` does more."""

from __future__ import annotations

import random

import pytest

from tests.fuzz.fuzz import CORPUS, fault_of, mutated, seeds_of
from tests.fuzz.readers import readers

READERS = readers()
ROUNDS = 30


@pytest.mark.parametrize("name", READERS)
def test_a_reader_takes_its_seeds_and_refuses_what_is_wrong(name):
    reader = READERS[name]
    seeds = seeds_of(name, reader)
    assert reader.seeds
    dice = random.Random(name)
    for data in [*seeds, *(mutated(dice, seeds) for _ in range(ROUNDS))]:
        assert not fault_of(reader, data), data[:300]


@pytest.mark.parametrize("name", READERS)
def test_the_first_seed_is_taken(name):
    READERS[name].read(READERS[name].seeds[0])


def test_the_corpus_belongs_to_readers():
    known = {name.replace(" ", "_") for name in READERS}
    assert {path.name for path in CORPUS.iterdir()} <= known
