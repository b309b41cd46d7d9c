-- expect: 3: undefined global "load": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
local f = load("return 1")
