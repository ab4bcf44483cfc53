"""What every layer uses and no robot needs: arrays, whole files, cores, Ctrl-C, intervals, compiling."""
