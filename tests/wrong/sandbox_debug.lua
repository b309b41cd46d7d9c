-- expect: 3: undefined global "debug": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
debug.sethook()
