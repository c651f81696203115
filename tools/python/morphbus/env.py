"""Environments for learning, in the form that gymnasium's users expect, without gymnasium.

`WalkEnv` has `reset(seed=...)` and a `step(action)` of five values; `action_space` and `observation_space` have `low`, `high`, `shape`,
`dtype`, `sample()` and `contains()`. `ModulesEnv` is the same with an agent a module, in the form of PettingZoo's parallel environments.
"""
import numpy

import morphbus


class Box:
    """All arrays of a shape between two arrays, both ends included."""

    def __init__(self, low, high, seed=None):
        self.low = numpy.asarray(low, dtype=numpy.float64)
        self.high = numpy.asarray(high, dtype=numpy.float64)
        self.shape = self.low.shape
        self.dtype = self.low.dtype
        self.seed(seed)

    def seed(self, seed=None):
        """Makes what is drawn from now on follow from `seed`."""
        self._random = numpy.random.default_rng(seed)

    def sample(self):
        """An array of the box; where that has no end, one near 0."""
        bounded = numpy.isfinite(self.low) & numpy.isfinite(self.high)
        low, high = numpy.where(bounded, self.low, -1.0), numpy.where(bounded, self.high, 1.0)
        return self._random.uniform(low, high)

    def contains(self, x):
        """Whether `x` is one of them."""
        x = numpy.asarray(x)
        return x.shape == self.shape and bool(numpy.all(x >= self.low) and numpy.all(x <= self.high))

    def __repr__(self):
        return f'Box(shape={self.shape})'


class WalkEnv:
    """A robot whose joints an agent drives; the reward of a step is how far north its first module came in it (m).

    An action has a target for each joint that turns or slides (rad or m), within its limits; a joint without limits goes from -pi to
    pi. An observation has their positions and velocities, then position and rotation (w, x, y, z) of the first link in the world.

    robot, program   what runs beside the agent: the program gives roles, and may drive what the agent does not.
    ticks_a_step     control ticks (20 ms) of a step.
    seconds          sim time after which an episode is truncated.
    options          further keywords of morphbus.Run.
    """

    metadata = {'render_modes': []}

    def __init__(self, robot, program, ticks_a_step=5, seconds=10.0, **options):
        self.robot, self.program = robot, program
        self.ticks_a_step, self.seconds, self.options = ticks_a_step, seconds, options
        joints = [(number, joint) for number, joint in enumerate(robot.joints) if joint.type != morphbus.JointType.fixed]
        self.joints = [number for number, _ in joints]
        low = [joint.lower if numpy.isfinite(joint.lower) else -numpy.pi for _, joint in joints]
        high = [joint.upper if numpy.isfinite(joint.upper) else numpy.pi for _, joint in joints]
        self.action_space = Box(low, high)
        size = 2 * len(joints) + 7
        self.observation_space = Box(numpy.full(size, -numpy.inf), numpy.full(size, numpy.inf))
        self.run = None
        self._episode = 0

    def reset(self, seed=None, options=None):
        """Begins an episode; `seed` is that of all chance in it. Returns the observation and a dict."""
        del options
        self.close()
        if seed is not None:
            self._episode = int(seed)
            self.action_space.seed(seed)
        else:
            self._episode += 1
        number = self._episode % 1_000_000_000
        self.run = morphbus.Run(self.robot, self.program, **{'random_seed': number, 'noise_seed': number, **self.options})
        seen = self.run.observe()
        self._north = seen.link_position[0][0]
        return self._observation(seen), {'tick': seen.tick}

    def step(self, action):
        """Drives the joints and goes on. Returns observation, reward, terminated, truncated and a dict."""
        action = numpy.clip(numpy.asarray(action, dtype=numpy.float64), self.action_space.low, self.action_space.high)
        for joint, target in zip(self.joints, action):
            self.run.drive(joint, float(target))
        self.run.step(self.ticks_a_step)
        seen = self.run.observe()
        north = seen.link_position[0][0]
        reward, self._north = float(north - self._north), north
        return self._observation(seen), reward, self.run.over, seen.time_s >= self.seconds, {'tick': seen.tick, 'roles': seen.roles}

    def close(self):
        """Ends the episode."""
        if self.run is not None:
            self.run.close()
            self.run = None

    def _observation(self, seen):
        return numpy.concatenate([seen.position[self.joints], seen.velocity[self.joints], seen.link_position[0], seen.link_rotation[0]])


class ModulesEnv:
    """The same with an agent a module, by the modules' names: each sees and drives its own joints, and all have the same reward.

    `reset` returns dicts of observations and infos by agent, `step` takes a dict of actions and returns five dicts.
    """

    metadata = {'render_modes': []}

    def __init__(self, robot, program, ticks_a_step=5, seconds=10.0, **options):
        self._walk = WalkEnv(robot, program, ticks_a_step, seconds, **options)
        self.possible_agents = [module.name for module in robot.modules]
        self.agents = []
        # The places of each agent's joints in the whole action.
        self._own = {agent: [i for i, joint in enumerate(self._walk.joints) if robot.modules[robot.joints[joint].module].name == agent]
                     for agent in self.possible_agents}
        space = self._walk.action_space
        self._actions = {agent: Box(space.low[own], space.high[own]) for agent, own in self._own.items()}
        self._observations = {agent: Box(numpy.full(2 * len(own), -numpy.inf), numpy.full(2 * len(own), numpy.inf))
                              for agent, own in self._own.items()}

    def action_space(self, agent):
        """The targets of the agent's joints."""
        return self._actions[agent]

    def observation_space(self, agent):
        """Their positions and velocities."""
        return self._observations[agent]

    def reset(self, seed=None, options=None):
        """Begins an episode."""
        seen, told = self._walk.reset(seed, options)
        self.agents = list(self.possible_agents)
        return self._shares(seen), {agent: dict(told) for agent in self.agents}

    def step(self, actions):
        """Drives the joints of all agents and goes on."""
        whole = numpy.zeros(len(self._walk.joints))
        for agent, own in self._own.items():
            whole[own] = actions[agent]
        seen, reward, terminated, truncated, told = self._walk.step(whole)
        agents = self.agents
        if terminated or truncated:
            self.agents = []
        return (self._shares(seen), {agent: reward for agent in agents}, {agent: terminated for agent in agents},
                {agent: truncated for agent in agents}, {agent: dict(told) for agent in agents})

    def close(self):
        """Ends the episode."""
        self._walk.close()

    def _shares(self, seen):
        count = len(self._walk.joints)
        return {agent: numpy.concatenate([seen[:count][own], seen[count:2 * count][own]]) for agent, own in self._own.items()}
