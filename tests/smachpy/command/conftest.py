from tests.simulated_robot import office

__all__ = ["office"]
