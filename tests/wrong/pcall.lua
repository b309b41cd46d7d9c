-- expect: 3: undefined global "pcall": a model has no such function or library, models/README.md names what it has
local rd = require "refdyn"
pcall(error)
