"""Files that are whole or absent: atomic writes, locks, leftovers, the one cache (no numpy).

atomic     Files that are whole or absent: written beside, flushed to the disk, then renamed
cache      Things computed once and kept: where they lie, and how the folder is kept from growing without
           end
disk       Room on disks: how much is free, whether it ran out, and how a size is written
leftovers  What a killed process leaves behind: half-written files and scratch folders, and how they are
           removed
lock       One window at a time may change a project: a lock that the system itself drops when its holder
           dies
process    Whether a process lives, and when it began, which tells it from a later one of the same number
"""
