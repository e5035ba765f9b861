#![no_main]

meltpath_fuzz::target!("vector_list");
