-- expect: 0: the file returns 2 values; must return one
local rd = require "refdyn"
local model = rd.model { name = "wrong", links = { { "a", joint = "z", mass = 1 } } }
return model, { extra = true }
