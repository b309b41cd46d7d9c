-- expect: 3: undefined global "load": a model has no such function or library, models/README.md names what it has
local rd = require "refdyn"
local f = load("return 1")
