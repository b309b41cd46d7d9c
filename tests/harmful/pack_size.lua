-- expect: 5: string.packsize: more work than the 100 million steps that a model may take while it is read
-- Tries a format of a million letters.
local rd = require "refdyn"
local form = (" "):rep(1e6)
for i = 1, 1e6 do string.packsize(form) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
