-- expect: 3: rd.gravity: assignment, what rd has is read only, a local has values of your own
local rd = require "refdyn"
rd.gravity = { 0, 0, -9.81 }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
