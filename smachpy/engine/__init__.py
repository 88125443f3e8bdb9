"""How a machine runs: visits of states, threads, preemption, retries."""
