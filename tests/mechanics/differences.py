"""Derivatives by parameters, and differences of whole solves to hold them against."""

import numpy as np
from prototype import prototype

from prb3r.mechanics.chain import loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.equilibrium import Outcome, solve_chain

STEP = 1e-5


def parameters(chain, steps):
    """Problems as functions of one number each, which is 1 for the chain and the loads themselves."""
    first = np.arange(len(chain.reach)) == 0
    plate = (np.arange(chain.plates) == 1)[:, None]
    pulley = np.ones(len(chain.reach)) * chain.pulley
    return {
        "stiffness": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps),
        "one plate": lambda v: (chain._replace(stiffness=chain.stiffness * (1 + (v - 1) * plate)), steps),
        "friction": lambda v: (chain._replace(friction=chain.friction + (v - 1)), steps),
        "offset": lambda v: (chain._replace(offset=chain.offset + 0.01 * (v - 1) * first), steps),
        "length": lambda v: (chain._replace(arc=chain.arc * v, stiffness=chain.stiffness / v), steps),
        "clamp": lambda v: (chain._replace(clamp=chain.clamp + 0.01 * (v - 1)), steps),
        "disk": lambda v: (chain._replace(disk=chain.disk + 0.01 * (v - 1)), steps),
        "rest": lambda v: (chain._replace(rest=chain.rest + 0.01 * (v - 1)), steps),
        "pulley": lambda v: (chain._replace(pulley=pulley * v), steps),
        "friction exponent": lambda v: (chain._replace(friction_exponent=chain.friction_exponent + (v - 1)), steps),
        "umbilical": lambda v: (chain._replace(umbilical=chain.umbilical + (v - 1)), steps),
        "softening": lambda v: (chain._replace(softening=chain.softening + 0.1 * (v - 1)), steps),
        "zero drift": lambda v: (chain._replace(zero_drift=chain.zero_drift + first * (v - 1)), steps),
        "clearance": lambda v: (chain._replace(clearance=chain.clearance + 1e-3 * (v - 1)), steps),
        "law": lambda v: (chain._replace(law=chain.law._replace(cubic=chain.law.cubic + 0.1 * (v - 1))), steps),
        "tension": lambda v: (chain, steps._replace(tension=steps.tension * v)),
        "force": lambda v: (chain, steps._replace(force=steps.force + 0.1 * (v - 1))),
        "moment": lambda v: (chain, steps._replace(moment=steps.moment + 0.1 * (v - 1))),
        "tip": lambda v: (chain, steps._replace(tip=steps.tip + (v - 1))),
    }


def aging(steps):
    """The same steps, two steps of the recording after each other."""
    return steps._replace(elapsed=1.0 + 2 * np.arange(steps.steps)[:, None])


def good(chain, steps, **options):
    found = solve_chain(chain, steps, **options)
    assert (found.outcome == Outcome.CONVERGED).all()
    return found


def derivatives(chain, steps, problems, **options):
    """(p, ...) x, y, angles and tensions of all steps in one row a parameter."""
    found = chain_sensitivities(
        chain, steps, [direction(problem, 1.0, STEP) for problem in problems.values()], **options
    )
    fields = found.dx, found.dy, found.dangle, found.dtension
    return [np.moveaxis(field, -1, 0) for field in fields]


def worst_errors(chain, steps, names=None, step=1e-4, **options):
    """{parameter: largest difference to central differences of whole solves, of the largest derivative}.

    Solves stop at 1e-11 rad; where they stop depends on parameters, too, which shows in derivatives below 0.01.
    """
    problems, worst = parameters(chain, steps), {}
    problems = {name: problems[name] for name in names or problems}
    found = derivatives(chain, steps, problems, **options)
    for k, (name, problem) in enumerate(problems.items()):
        ahead, behind = (good(*problem(1 + side * step), **options) for side in (1, -1))
        pairs = zip(found, ("x", "y", "angle", "tension"), strict=True)
        errors = []
        for mine, field in pairs:
            difference = (getattr(ahead, field) - getattr(behind, field)) / (2 * step)
            errors.append(np.abs(mine[k] - difference).max() / (np.abs(difference).max() + 0.01))
        worst[name] = max(errors)
    return worst


def loop(presliding, mu=0.3):
    """Pulled, let go, pulled again, then a second cable and a tip load: holes stick, slip and turn back."""
    chain = prototype(mu)._replace(presliding=presliding)
    table = np.zeros((5, 4))
    table[:, 0], table[3:, 2] = [100, 60, 80, 80, 30], [40, 70]
    tip = np.zeros((5, 2))
    tip[2:] = [0.5, -1.0]
    return chain, loads(chain, table, tip=tip, elapsed=np.arange(5.0)[:, None])
