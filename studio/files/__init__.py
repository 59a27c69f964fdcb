"""Files that are whole or absent: atomic writes, locks, leftovers, the one cache (no numpy).

atomic     Files that are whole or absent: written under another name, flushed, then renamed; and space on
           disks
cache      Things computed once and kept: where they lie, and how the folder is kept from growing without
           end
download   Downloads: a file is gone on with after a break, checked against its digest, and never executed
leftovers  What a killed process leaves behind: half-written files and scratch folders, and how they are
           removed
lock       Which process may change a project, whether a process lives, and when it began
"""
