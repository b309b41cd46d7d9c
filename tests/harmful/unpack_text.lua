-- expect: 5: string.unpack: more than the 100 million steps that reading a model may take
-- Tries to unpack a long text with a long format.
local rd = require "refdyn"
local s, form = ("x"):rep(1e6), ("b"):rep(1e5)
for i = 1, 1e6 do string.unpack(form, s) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
