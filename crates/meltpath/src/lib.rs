//! meltpath as a library: job files, the pipelines, the data that ships.
