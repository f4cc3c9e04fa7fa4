from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob
from cbagan_ompl.planning.problem import set_parameter


def test_set_parameter_calls_the_setter() -> None:
    space = compat.plane_space(np.zeros(2), np.ones(2))
    planner = compat.planner_class("RRTstar")(ob.SpaceInformation(space))
    set_parameter(planner, "rewire_factor", 1.3)
    set_parameter(planner, "range", 7)
    set_parameter(planner, "k_nearest", False)
    set_parameter(planner, "delay_cc", False)
    assert planner.getRewireFactor() == 1.3
    assert planner.getRange() == 7
    assert planner.getKNearest() is False
    assert planner.getDelayCC() is False
    with pytest.raises(ConfigError, match=r"no parameter 'magic' to set.*setRewireFactor"):
        set_parameter(planner, "magic", 1)
