/prog test_logic
/attr
owner = mneditor;
/mn
1: uframe_num = 1;
2: utool_num=1;
3: for R[1]=1 to 10;
4: l p[1] 50mm/sec cnt100 Offset,PR[3:"shift x"];
5: endfor;
6: if DI[1]=on,jmp lbl[9];
7: j PR[1:safe] 50% fine;
8: call sub_one;
9: lbl[9:end];
10: wait DI[3]=on timeout,lbl[9];
11: SELECT R[2]=1,CALL A1;
   :        =2,JMP LBL[9];
   :        ELSE,CALL A3;
12: l p[1] 2.0 sec fine
13: Touch Offset PR[5]
14: l p[2:"a;b"] R[5:v]mm/sec CD5 ;
plain text without number
/POS
p[1]{ gp1: uf : 1, ut : 1, config : 'n u t, 0, 0, 0', x = 1 mm, y = -2.5 mm, z = 3 mm, w = 0 deg, p = 0 deg, r = 0 deg };
/END
