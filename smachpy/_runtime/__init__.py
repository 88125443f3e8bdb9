"""What carries a running machine: frames, events, callbacks, preemption, child tasks."""
