-- expect: 5: string.packsize: more than the 100 million steps that reading a model may take
-- Tries a format of a million letters.
local rd = require "refdyn"
local form = (" "):rep(1e6)
for i = 1, 1e6 do string.packsize(form) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
