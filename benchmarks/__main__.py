"""Run every benchmark and print one table."""

from benchmarks import environment, genetic, postures, startup, studio
from benchmarks.report import command_line

command_line(__doc__, postures.measure, genetic.measure, environment.measure, startup.measure, studio.measure)
