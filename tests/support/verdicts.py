"""What a reproduction says of each of its results."""

from reproduce.records import Records


def verdicts(case, folder):
    return {each.name: each.verdict for each in case.evaluate(Records(folder), True).results}
