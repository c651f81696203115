"""The file of a campaign: a line of JSON for each case that is done, written whole or not at all."""
import fcntl
import hashlib
import json
import os
import pathlib

from cases.case import MODELS, ROOT

# What the cases follow from. A campaign goes on only with the same cases, for else a number would mean two of them.
_PARTS = ('chance', 'modules', 'robots', 'programs', 'case', 'ways', 'disturbances')


class WrongFile(Exception):
    """A file that holds no results, or those of other cases."""


def generator():
    """Twelve digits that are others whenever a number stands for another case."""
    digest = hashlib.sha256()
    files = [pathlib.Path(__file__).with_name(f'{part}.py') for part in _PARTS] + [ROOT / 'tools' / 'gait_table']
    files += sorted(MODELS.glob('*.m3l')) + sorted((MODELS / 'programs').glob('*.dyn'))
    for path in files:
        digest.update(path.name.encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()[:12]


def read(path):
    """(records, bytes up to the end of the last whole line). What a kill left of a line counts for nothing."""
    data = pathlib.Path(path).read_bytes()
    whole = data.rfind(b'\n') + 1
    records = []
    for number, line in enumerate(data[:whole].splitlines(), 1):
        try:
            record = json.loads(line)
            records.append(record)
            # All that the counts look at must be there.
            assert isinstance(record['case'], int) and isinstance(record['generator'], str)
            assert all(isinstance(run['way'], str) and isinstance(run['result'], str) for run in record['runs'])
        except (ValueError, KeyError, TypeError, AssertionError):
            raise WrongFile(f'{path}:{number}: this is no line of a campaign\'s results') from None
    if whole == 0 and data and not data.startswith(b'{'):
        raise WrongFile(f'{path}: this is no file of a campaign\'s results')
    return records, whole


class Results:
    """The file while a campaign writes to it, alone."""

    def __init__(self, path, version):
        self._version, self._generator = version, generator()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._file)
            raise WrongFile(f'{path}: another campaign writes to it') from None
        self.records, whole = read(path)
        if any(record['generator'] != self._generator for record in self.records):
            raise WrongFile(f'{path}: its cases are others than those of this version; begin another file')
        os.ftruncate(self._file, whole)
        self.done = {record['case'] for record in self.records}

    def append(self, record):
        record = {**record, 'generator': self._generator, 'version': self._version}
        line = json.dumps(record, separators=(',', ':')).encode() + b'\n'
        whole = os.fstat(self._file).st_size
        try:
            while line:
                line = line[os.write(self._file, line):]
        except OSError:
            # Behind a part of a line another one would make both unreadable.
            os.ftruncate(self._file, whole)
            raise
        self.records.append(record)
        self.done.add(record['case'])
