"""What the page's server answers to requests that no page makes."""

from __future__ import annotations

import urllib.error
import urllib.parse
import urllib.request

import pytest


@pytest.mark.parametrize("last", ["x:²", "x:٣", "x:-1", "x", "x:", f"x:{'9' * 5000}", "x:1.0"])
def test_the_id_of_no_event_is_refused(served, last):
    served.add("one")
    address = served.start() + f"api/events?last={urllib.parse.quote(last)}"
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(address, timeout=10)
    with caught.value:
        assert caught.value.code == 400


@pytest.mark.parametrize("last", ["", "x:0", "an epoch: of any kind:12"])
def test_the_id_of_an_event_is_taken(served, last):
    served.add("one")
    address = served.start() + f"api/events?last={urllib.parse.quote(last)}"
    with urllib.request.urlopen(address, timeout=10) as answer:
        assert answer.status == 200
