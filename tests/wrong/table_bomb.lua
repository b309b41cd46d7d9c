-- expect: 4: more values in the model than 1000000
local rd = require "refdyn"
local t = {}
for i = 1, 25 do t = { t, t } end
return rd.model { name = "wrong", links = t }
