-- expect: 4: tostring of an expression: its value is not known while the model is read
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong" .. tostring(p.n), links = { { "a", joint = "x", mass = 1 } } }
