#![no_main]

meltpath_fuzz::target!("cli_binary");
