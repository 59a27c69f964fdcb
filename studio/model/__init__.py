"""Networks, one file each (torch): a module offers `build(sizes, **network settings) -> Network`."""
