#!/usr/bin/env python
# Iterators in iterators, over a callable and over userdata, left by a break.
import rospy
from smach import CBState, Iterator, StateMachine, cb_interface


@cb_interface(input_keys=["room", "shelf"], output_keys=["found"], outcomes=["found", "empty"])
def look(ud):
    rospy.loginfo("room %s shelf %d", ud.room, ud.shelf)
    if (ud.room, ud.shelf) == ("study", 2):
        ud.found = "%s/%d" % (ud.room, ud.shelf)
        return "found"
    return "empty"


def construct():
    sm = StateMachine(outcomes=["found", "nowhere"])
    sm.userdata.rooms = ["hall", "study", "attic"]
    with sm:
        rooms = Iterator(
            outcomes=["found", "nowhere"],
            input_keys=["rooms"],
            output_keys=["found"],
            it=lambda: ["hall", "study", "attic"],
            it_label="room",
            exhausted_outcome="nowhere",
        )
        with rooms:
            one_room = StateMachine(
                outcomes=["found", "continue"], input_keys=["room"], output_keys=["found"]
            )
            with one_room:
                shelves = Iterator(
                    outcomes=["found", "none"],
                    input_keys=["room"],
                    output_keys=["found"],
                    it=range(1, 4),
                    it_label="shelf",
                    exhausted_outcome="none",
                )
                with shelves:
                    Iterator.set_contained_state("LOOK", CBState(look), loop_outcomes=["empty"])
                StateMachine.add("SHELVES", shelves, {"found": "found", "none": "continue"})
            Iterator.set_contained_state("ROOM", one_room, loop_outcomes=["continue"])
        StateMachine.add("ROOMS", rooms, {"found": "found", "nowhere": "nowhere"})
    return sm


def main():
    rospy.init_node("iterators")
    sm = construct()
    outcome = sm.execute()
    rospy.loginfo("%s: %s", outcome, sm.userdata.found)


if __name__ == "__main__":
    main()
