from tests.simulated_robot import clock, office, office_robot, simulate, simulate_on, simulation

__all__ = ["clock", "office", "office_robot", "simulate", "simulate_on", "simulation"]
