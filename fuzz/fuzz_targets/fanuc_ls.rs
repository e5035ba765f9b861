#![no_main]

meltpath_fuzz::target!("fanuc_ls");
