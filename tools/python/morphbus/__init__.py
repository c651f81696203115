"""Modular robots: models, programs, runs and logs.

    import morphbus

    model = morphbus.Model('models/mtran.m3l')
    robot = model.robot('quadruped')
    program = morphbus.Program('models/programs/quadruped.dyn', model)
    with morphbus.Run(robot, program, seconds=10) as run:
        while not run.over:
            run.step(5)
            print(run.observe().time_s, run.observe().link_position[0])

Units are SI (m, rad, s, N, N m); quaternions are w, x, y, z. The robot frame has x north, y up, z east. What cannot be had is a
`Failure`; a text with errors a `TextError`, whose `diagnostics` have the places.
"""
import json as _json
import os as _os
import sys as _sys

# The engine must compute with Morphbus's functions of C and not with those that Python has loaded, or runs would have other bits
# than elsewhere: what this module brings is looked for among itself first.
_flags = _sys.getdlopenflags()
_sys.setdlopenflags(_flags | getattr(_os, 'RTLD_DEEPBIND', 0))
try:
    from morphbus import _core
    from morphbus._core import (Alignment, Batch, Comparison, ComparedItem, Congruence, Connection, ConnectionOption, ConnectionType,
                                Diagnostic, DiagnosticNote, Failure, Joint, JointSeries, JointType, KinematicGraph, Link, LinkPoses, Log,
                                Model, Module, ModuleType, Observation, Parameter, PoseSeries, Program, Robot, Role, RolePlayed, Run,
                                RunResult, TextError, TextRange, Verdict, arithmetic_fingerprint, check, compare, format_dynarole, format_m3l)
finally:
    _sys.setdlopenflags(_flags)

__all__ = ['Alignment', 'Batch', 'Comparison', 'ComparedItem', 'Congruence', 'Connection', 'ConnectionOption', 'ConnectionType',
           'Diagnostic', 'DiagnosticNote', 'Failure', 'Joint', 'JointSeries', 'JointType', 'KinematicGraph', 'Link', 'LinkPoses', 'Log',
           'Model', 'Module', 'ModuleType', 'Observation', 'Parameter', 'PoseSeries', 'Program', 'Robot', 'Role', 'RolePlayed', 'Run',
           'RunResult', 'TextError', 'TextRange', 'Verdict', 'arithmetic_fingerprint', 'check', 'compare', 'dataframe', 'format_dynarole', 'format_m3l',
           'info', 'summary']


def info(log):
    """All that `morphbus info --json` tells of a log, as a dict (docs/log.md)."""
    return _json.loads(log.info_json())


def summary(run):
    """All that `morphbus run --json` tells of a run that is closed, as a dict (docs/cli.md)."""
    return _json.loads(run.summary_json())


def dataframe(log):
    """The joints of a log as a pandas DataFrame: a row a tick, by time; columns are (joint, 'position'), 'velocity' and 'effort'.

    pandas is imported here and nowhere else.
    """
    import pandas
    columns = {}
    for joint in log.robot.joints:
        series = log.joint(joint.name)
        for name in ('position', 'velocity', 'effort'):
            columns[joint.name, name] = pandas.Series(getattr(series, name), index=series.time_s)
    frame = pandas.DataFrame(columns)
    frame.index.name = 'time_s'
    return frame
