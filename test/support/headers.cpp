// Nothing: the target's precompiled headers are what other tests use.
