"""Run every benchmark and print one table."""

from benchmarks import genetic, postures, startup
from benchmarks.report import command_line

command_line(__doc__, postures.measure, genetic.measure, startup.measure)
