"""A model or a controller that leaves Python: as C99, and as a functional mock-up unit (FMU) of FMI 2.0 or 3.0.

In: a `System` (`from_files.plant_source`), or a controller with its estimator and its gains (`from_files.controller_source`). Out: C with its header
(`write.write_c`), or an FMU (`write.write_fmu`). Nothing of Python is in them.

A `block.Block` starts and steps by the package's own functions (`plant`, `controller`). Traced by JAX for one run (`compiled`), these become
statements, one name a number (`translate`, `operations`, `arrays`, `statements`), and lines that both precisions share (`c_text`, `source`). The
interface of an FMU is C by hand (`c/`), its description XML (`model_description`), both zipped by `fmu`.
"""
