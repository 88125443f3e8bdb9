#!/usr/bin/env python
# A machine whose states, keys and transitions are data; everything is looked at and logged.
import smach
import rospy

TABLE = {
    "initial": "LOAD",
    "outcomes": ["done", "empty"],
    "states": {
        "LOAD": {
            "to": {"succeeded": "PACK", "aborted": "empty"},
            "in": ["stock"],
            "out": ["stock", "parcel"],
        },
        "PACK": {"to": {"succeeded": "COUNT"}, "in": ["parcel"], "out": ["packed"]},
        "COUNT": {
            "to": {"succeeded": "LOAD", "aborted": "done"},
            "in": ["packed", "total"],
            "out": ["total"],
        },
    },
}


def load(ud):
    if not ud.stock:
        return "aborted"
    ud.parcel = ud.stock[0]
    ud.stock = ud.stock[1:]
    return "succeeded"


def pack(ud):
    ud.packed = "<%s>" % ud.parcel
    return "succeeded"


def count(ud):
    ud.total = ud.total + [ud.packed]
    return "aborted" if len(ud.total) == 2 else "succeeded"


class FromTable(smach.State):
    def __init__(self, name, row):
        smach.State.__init__(self, outcomes=["succeeded", "aborted"])
        self.register_input_keys(row["in"])
        self.register_output_keys(row["out"])
        self.function = globals()[name.lower()]

    def execute(self, userdata):
        return self.function(userdata)


class Builder(object):
    def __init__(self, table):
        self.table = table
        self.log = []

    def started(self, userdata, initial_states, where, *rest):
        self.log.append(("start", where, list(initial_states)))

    def moved(self, userdata, active_states, *args):
        self.log.append(("move", args[0], list(active_states)))

    def over(self, userdata, terminal_states, outcome):
        self.log.append(("end", list(terminal_states), outcome))

    def build(self):
        sm = smach.StateMachine(outcomes=self.table["outcomes"])
        with sm:
            for name in sorted(self.table["states"]):
                row = self.table["states"][name]
                state = FromTable(name, row)
                transitions = dict(row["to"])
                transitions.setdefault("aborted", self.table["outcomes"][-1])
                smach.StateMachine.add(name, state, transitions)
                for key in set(state.get_registered_input_keys()) | set(
                    state.get_registered_output_keys()
                ):
                    sm.register_io_keys([key])
        sm.set_initial_state([self.table["initial"]])
        sm.register_start_cb(self.started, [self.table["initial"], "more"])
        sm.register_transition_cb(self.moved, cb_args=["top"])
        sm.register_termination_cb(self.over)
        return sm


def main():
    rospy.init_node("from_table")
    builder = Builder(TABLE)
    sm = builder.build()
    sm.check_consistency()
    sm.userdata.update({"stock": ["a", "b", "c"], "total": []})
    rospy.loginfo("%s %s %s", sm.get_children().keys(), sm.get_initial_states(), sm.is_running())
    outcome = sm.execute()
    for line in builder.log:
        rospy.loginfo(line)
    rospy.loginfo("%s %s %s", outcome, sm.userdata.total, sorted(sm.userdata.keys()))
    assert "parcel" in sm.userdata and not sm.is_running()


main()
