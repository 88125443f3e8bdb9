"""Messages of several topics in step."""

import pytest

from actionlib_core.interfaces.geometry_msgs.msg import PointStamped
from actionlib_core.interfaces.std_msgs.msg import Empty
from smachpy import ros1


@pytest.fixture
def filters():
    with ros1.installed():
        import message_filters

        yield message_filters


def at(seconds):
    import rospy

    message = PointStamped()
    message.header.stamp = rospy.Time.from_sec(seconds)
    return message


def stamps(messages):
    return [message.header.stamp.to_sec() for message in messages]


def test_messages_of_one_stamp_are_passed_on_together(filters):
    left, right = filters.SimpleFilter(), filters.SimpleFilter()
    sets = []
    both = filters.TimeSynchronizer([left, right], 10)
    both.registerCallback(lambda *got: sets.append(got), "more")
    left.signalMessage(at(1))
    left.signalMessage(at(2))
    right.signalMessage(at(1.5))
    right.signalMessage(at(2))
    ((first, second, more),) = sets
    assert (first.header.stamp.to_sec(), second.header.stamp.to_sec(), more) == (2.0, 2.0, "more")
    right.signalMessage(at(2))
    assert len(sets) == 1


def test_stamps_may_differ_by_the_slop(filters):
    inputs = [filters.SimpleFilter() for _ in range(3)]
    sets = []
    near = filters.ApproximateTimeSynchronizer(inputs, 2, 0.1)
    near.registerCallback(lambda *got: sets.append(stamps(got)))
    for seconds in (0.5, 1.0, 2.0):  # the first does not fit into the queue
        inputs[0].signalMessage(at(seconds))
    inputs[1].signalMessage(at(0.5))
    inputs[2].signalMessage(at(0.5))
    assert sets == []
    inputs[1].signalMessage(at(1.06))
    inputs[2].signalMessage(at(0.94))
    assert sets == []
    inputs[2].signalMessage(at(0.98))
    assert sets == [[1.0, 1.06, 0.98]]


def test_a_cache_answers_by_time(filters):
    source = filters.SimpleFilter()
    cache = filters.Cache(source, 3)
    assert cache.getLast() is None
    for seconds in range(1, 6):
        source.signalMessage(at(seconds))
    source.signalMessage(Empty())  # has no stamp
    assert stamps(cache.getInterval(at(3).header.stamp, at(4).header.stamp)) == [3.0, 4.0]
    assert cache.getElemAfterTime(at(3.5).header.stamp).header.stamp.to_sec() == 4.0
    assert cache.getElemBeforeTime(at(3.5).header.stamp).header.stamp.to_sec() == 3.0
    assert cache.getOldestTime().to_sec() == 3.0
    assert cache.getLastestTime().to_sec() == 5.0
