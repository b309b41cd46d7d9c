-- expect: 3: undefined global "pcall": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
pcall(error)
