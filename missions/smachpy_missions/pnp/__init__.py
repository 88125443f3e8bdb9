"""The classic shapes of Petri Net Plans; see docs/petri_net_plans.md."""
