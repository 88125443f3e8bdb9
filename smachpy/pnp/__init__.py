"""Petri Net Plans: Petri nets whose places run actions, an alternative to state machines.

from smachpy import pnp

net, problems = pnp.read_pnml("fetch.pnml")
plan = pnp.understand(net, problems=problems)
for problem in pnp.check_plan(plan):
    print(problem)
"""

from __future__ import annotations

from smachpy.pnp.actions import Call as Call
from smachpy.pnp.actions import Function as Function
from smachpy.pnp.actions import Goal as Goal
from smachpy.pnp.actions import Made as Made
from smachpy.pnp.build import Part as Part
from smachpy.pnp.build import action as action
from smachpy.pnp.build import choose as choose
from smachpy.pnp.build import fork as fork
from smachpy.pnp.build import go_to as go_to
from smachpy.pnp.build import loop as loop
from smachpy.pnp.build import mark as mark
from smachpy.pnp.build import sense as sense
from smachpy.pnp.check import check_plan as check_plan
from smachpy.pnp.conditions import Condition as Condition
from smachpy.pnp.conditions import ConditionError as ConditionError
from smachpy.pnp.container import PetriNetPlan as PetriNetPlan
from smachpy.pnp.container import load as load
from smachpy.pnp.export import export_net as export_net
from smachpy.pnp.files import load_plan as load_plan
from smachpy.pnp.knowledge import Expression as Expression
from smachpy.pnp.knowledge import Polled as Polled
from smachpy.pnp.knowledge import TopicCondition as TopicCondition
from smachpy.pnp.net import Arc as Arc
from smachpy.pnp.net import Net as Net
from smachpy.pnp.net import Place as Place
from smachpy.pnp.net import Transition as Transition
from smachpy.pnp.plan import Plan as Plan
from smachpy.pnp.plan import understand as understand
from smachpy.pnp.pnml import parse_pnml as parse_pnml
from smachpy.pnp.pnml import pnml_text as pnml_text
from smachpy.pnp.pnml import read_pnml as read_pnml
from smachpy.pnp.pnml import write_pnml as write_pnml
from smachpy.pnp.pnp_cmd import PNPCmd as PNPCmd
from smachpy.pnp.problems import PlanError as PlanError
from smachpy.pnp.problems import PlanProblem as PlanProblem
from smachpy.pnp.reach import Reachable as Reachable
from smachpy.pnp.reach import explore as explore
from smachpy.pnp.reading import read_net as read_net
from smachpy.pnp.server import PNPServer as PNPServer
from smachpy.pnp.text import parse_pddl as parse_pddl
from smachpy.pnp.text import parse_plan as parse_plan
from smachpy.pnp.text import parse_rules as parse_rules
