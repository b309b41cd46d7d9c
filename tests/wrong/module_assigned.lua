-- expect: 3: rd.gravity: assignment to rd, which is read only; use a local variable
local rd = require "refdyn"
rd.gravity = { 0, 0, -9.81 }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
