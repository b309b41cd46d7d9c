-- expect: 3: undefined global "next": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
next(error)
