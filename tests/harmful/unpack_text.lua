-- expect: 5: string.unpack: more work than the 100 million steps that a model may take while it is read
-- Tries to unpack a long text with a long format.
local rd = require "refdyn"
local s, form = ("x"):rep(1e6), ("b"):rep(1e5)
for i = 1, 1e6 do string.unpack(form, s) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
