"""Random numbers of which everything in a campaign follows."""
import random


class Chance:
    """Draws by `random.Random.random` alone, of which Python promises that its numbers stay the same in all versions: a case is
    the same robot wherever it is run again."""

    def __init__(self, *names):
        self._random = random.Random('/'.join(map(str, names))).random

    def happens(self, probability):
        return self._random() < probability

    def between(self, least, most):
        return least + (most - least) * self._random()

    def whole(self, least, most):
        """A whole number, both ends included."""
        return least + int(self._random() * (most - least + 1))

    def one(self, things):
        return things[self.whole(0, len(things) - 1)]

    def weighted(self, weights):
        """A key of `weights`, as often as its value says."""
        left = self._random() * sum(weights.values())
        for thing, weight in weights.items():
            left -= weight
            if left < 0:
                return thing
        return thing

    def shuffled(self, things):
        things = list(things)
        for last in range(len(things) - 1, 0, -1):
            other = self.whole(0, last)
            things[last], things[other] = things[other], things[last]
        return things

    def some(self, things, least, most):
        """So many different ones, fewer where there are fewer; in any order."""
        return self.shuffled(things)[:self.whole(least, most)]
