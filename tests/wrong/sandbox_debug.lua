-- expect: 3: undefined global "debug": a model has no such function or library, models/README.md names what it has
local rd = require "refdyn"
debug.sethook()
